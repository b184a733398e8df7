"""The RRC emulator: its command and its panel."""
