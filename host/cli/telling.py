"""What is told to the people at a command, on standard error."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import click


def say(text: str) -> None:
    """Tell people; standard output is for programs."""
    click.echo(text, err=True)


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
