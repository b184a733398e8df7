"""Clocks of hosts: run code that calls `time.sleep` and `time.monotonic` in the time of a rig."""
