"""Log files written."""
