"""How a verb ends that could not do all it was asked."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import click

from tickrig.host.cli.start import FULL


class SourceFailed(click.ClickException):
    """One line on standard error, and exit status 3."""

    exit_code = 3


@contextmanager
def until_unread() -> Iterator[None]:
    """End the block quietly when nobody reads standard output any more, as before `| head`.

    Raises:
        SourceFailed: it cannot be written, as where the disk is full.
    """
    try:
        yield
    except BrokenPipeError:
        _leave()
    except OSError as error:
        if error.errno not in FULL:
            raise
        _leave()
        raise SourceFailed(f"standard output: {error.strerror or error}") from error


def _leave() -> None:
    """Send what is still to be flushed, at exit too, nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
