"""Carts of Reference Hardware 3 that drive: closed loops, convoys, and the command `rh3`."""
