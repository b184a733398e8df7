"""A Modbus slave on a serial line, and the registers it holds."""
