"""Frames to send: cyclic, with counters and checksums, and PDOs by the names of their objects."""
