"""Motors with their power stage, gear and load, and the control loops around them."""
