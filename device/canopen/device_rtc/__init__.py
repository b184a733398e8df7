"""DeviceRTC: an RT component inside a CANopen slave (NEDO report, 3.4.43.3)."""
