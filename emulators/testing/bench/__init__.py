"""A bench: devices on wires, their operators, and one common time."""
