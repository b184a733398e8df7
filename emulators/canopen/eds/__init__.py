"""Dictionaries out of EDS and DCF files."""
