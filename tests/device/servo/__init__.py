"""Motors with their power stage, gear and load, and the loops around them."""
