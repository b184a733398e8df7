"""Modes of operation of a drive (CiA 402-2), and Maxon's own modes."""
