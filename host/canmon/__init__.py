"""canmon: the CAN monitor in the terminal."""
