"""Modes of a bench: virtual time, real time, real hardware."""
