"""Scenario files, their player, and how a fault is written."""
