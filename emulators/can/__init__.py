"""The emulated CAN bus (ISO 11898-1). A slave itself sorts the frames of a tick."""
