"""Doors between the emulated bus and others: python-can, the canopen library, real buses."""
