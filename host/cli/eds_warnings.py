"""What commands say of EDS files that are not by the standard."""

from __future__ import annotations

from collections.abc import Iterable

import click

from tickrig.wire.canopen.eds.eds_finding import Finding


def tell_findings(findings: Iterable[Finding]) -> None:
    """Say on standard error what is wrong in files; what is so in many sections, once."""
    places: dict[tuple[str, str], list[str]] = {}
    for finding in dict.fromkeys(findings):
        places.setdefault((finding.file, finding.reason), []).append(finding.section)
    for (file, reason), (first, *others) in places.items():
        more = f" (and {len(others)} more like it)" if others else ""
        click.echo(f"{Finding(file, first, reason)}{more}", err=True)
