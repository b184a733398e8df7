"""Where the devices of a bench are, and how time passes for them."""
