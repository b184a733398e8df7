"""How a proxy reaches its device: serial ports, CAN buses, lines that go and come back."""
