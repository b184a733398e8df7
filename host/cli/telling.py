"""What the library warns of, told to the people at a command."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def warnings_told() -> Iterator[None]:
    """Show warnings of the library on standard error, a line each; else it is silent."""
    logger, handler = logging.getLogger("tickrig"), logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
