"""Carts of Reference Hardware 3 that drive: closed loops, runs, maps, the command `rh3`."""
