"""Fuzzing of devices: bytes become what a host and the world do, each time from one snapshot."""
