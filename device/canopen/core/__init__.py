"""What a CANopen slave stands on: dictionary, entries, the slave; no service in particular."""
