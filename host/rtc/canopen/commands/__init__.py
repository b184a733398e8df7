"""The command lines of RTC-CANopen."""
