"""Robots' bodies on emulated drives."""
