"""The emulated CAN bus (ISO 11898-1); the slave itself sorts the frames of its tick."""
