"""Demonstrations of `tickrig demo`: a device and a host at work."""
