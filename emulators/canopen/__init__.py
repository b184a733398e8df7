"""CANopen slaves from files: EDS, DCF, bus.yml, and their non-volatile memory."""
