"""Rules that traffic must keep, and what breaks them."""
