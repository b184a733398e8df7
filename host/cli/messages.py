"""What commands say to people on standard error: remarks, warnings, faults of EDS files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from tickrig.wire.canopen.eds.eds_file import Finding


def say(text: str) -> None:
    """Tell people; standard output is for programs."""
    click.echo(text, err=True)


@contextmanager
def warnings_shown() -> Iterator[None]:
    """Show warnings of the library on standard error, a line each; else it is silent."""
    import logging  # noqa: PLC0415 - slow, and a TAB needs none

    logger, handler = logging.getLogger("tickrig"), logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


def show_findings(findings: Iterable[Finding]) -> None:
    """Say what is wrong in EDS files; what is so in many sections, once."""
    from tickrig.wire.canopen.eds.eds_file import finding_lines  # noqa: PLC0415 - a TAB needs none

    for line in finding_lines(findings):
        say(line)
