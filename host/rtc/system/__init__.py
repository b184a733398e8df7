"""Whole systems: their manager, their names, and the files they are saved in."""
