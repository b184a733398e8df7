"""Connections of the emulated bus to python-can, the canopen library and real buses."""
