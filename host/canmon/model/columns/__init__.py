"""The same for whole logs at once, in columns; needs numpy, and only here."""
