"""Searches for errors of a host: calls, faults and input changes in any order."""
