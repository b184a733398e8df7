"""Filters: their text, and what they ask of a frame."""
