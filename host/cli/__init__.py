"""Common parts of the command lines of host tools and emulators."""
