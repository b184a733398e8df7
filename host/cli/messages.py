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
    for line in finding_lines(findings):
        say(line)


def finding_lines(findings: Iterable[Finding]) -> Iterator[str]:
    """Give what is wrong in EDS files, a line each; what is so in many sections, once."""
    alike: dict[tuple[str, str], list[Finding]] = {}
    for finding in dict.fromkeys(findings):
        alike.setdefault((finding.file, finding.reason), []).append(finding)
    for first, *others in alike.values():
        more = f" (and {len(others)} more like it)" if others else ""
        yield f"{first}{more}"
