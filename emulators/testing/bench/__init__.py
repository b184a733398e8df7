"""A bench: devices on wires, hands at them, and time that passes in one place."""
