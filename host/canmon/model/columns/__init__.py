"""The same functions for whole logs at once, in columns. Only this package needs numpy."""
