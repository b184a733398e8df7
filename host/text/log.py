"""The loggers of the library, which are silent unless the program configures logging."""

from __future__ import annotations

import logging


def log_of(name: str) -> logging.Logger:
    """Return the logger of a module."""
    return logging.getLogger(name)


logging.getLogger("tickrig").addHandler(logging.NullHandler())
