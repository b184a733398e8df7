"""Rig files: what is on a bench, where it is on real hardware, and what is wrong with the file."""
