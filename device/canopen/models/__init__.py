"""Models of CANopen devices: their objects and their behaviour."""
