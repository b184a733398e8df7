"""Emulated serial lines, RS485, ptys and byte faults, and one device on them."""
