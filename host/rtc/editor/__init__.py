"""Screens of running systems of RT components: a picture of components and wires."""
