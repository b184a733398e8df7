"""What sets a CANopen network to work: its nodes found, addressed, configured, programmed."""
