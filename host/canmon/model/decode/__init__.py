"""CAN traffic as CANopen objects: decoded from evidence, nothing assumed."""
