"""RTC-CANopen on the host: CANopen devices shown as RT components (NEDO report, 3.4.43.3)."""
