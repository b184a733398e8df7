"""RTC-CANopen Builder: from the profile of a DeviceRTC to all that is written of it (K17)."""
