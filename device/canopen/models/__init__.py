"""Devices that are emulated out of the box: their objects and what they do with them."""
