"""Rig files: the devices of a bench, the places of real devices, and the errors in the file."""
