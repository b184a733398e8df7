"""What commands say to people on standard error: remarks, warnings, faults of EDS files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import click

from tickrig.wire.canopen.eds.eds_finding import Finding


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
    places: dict[tuple[str, str], list[str]] = {}
    for finding in dict.fromkeys(findings):
        places.setdefault((finding.file, finding.reason), []).append(finding.section)
    for (file, reason), (first, *others) in places.items():
        more = f" (and {len(others)} more like it)" if others else ""
        say(f"{Finding(file, first, reason)}{more}")
