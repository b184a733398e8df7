"""What masters and monitors say to a CANopen node: SDO transfers that never wait."""
