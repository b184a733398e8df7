"""Log files read, one module a format."""
