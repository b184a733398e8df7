"""Campaigns: tests of a bench, run with many seeds and parameters over processes or a cluster."""
