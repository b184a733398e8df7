"""Links to devices: serial ports, CAN buses, reconnecting lines."""
