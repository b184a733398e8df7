"""The base of Reference Hardware 3: two driven wheels, their driver, and the ground."""
