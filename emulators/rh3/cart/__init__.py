"""Carts of Reference Hardware 3 that drive: closed loops, journeys, maps, the command `rh3`."""
