"""CANopen slaves out of files: EDS, DCF and what survives a power cut."""
