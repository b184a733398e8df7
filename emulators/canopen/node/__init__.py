"""One emulated CANopen node, and several under one roof."""
