"""One frame: what was taken in, its identifier, its text."""
