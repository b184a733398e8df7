"""RTC-CANopen: what a DeviceRTC and those who talk to it know alike."""
