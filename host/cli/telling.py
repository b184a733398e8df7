"""What the library warns of, told to the people at a command."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def warnings_told() -> Iterator[None]:
    """Show warnings of the library on standard error, a line each; else it is silent."""
    import logging  # noqa: PLC0415 - slow, and a TAB needs none

    logger, handler = logging.getLogger("tickrig"), logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
