"""The System Editor: a running server on a terminal."""
