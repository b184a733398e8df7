"""Searches for what a host does wrong: calls, faults and hands in any order."""
