"""A badge for a README: how many checks passed, as SVG."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.verdict import FAILED, UNDECIDED, Report, Verdict

LABEL: Final = "CANopen"
COLOURS: Final = {0: "#2e7d32", FAILED: "#c62828", UNDECIDED: "#8a6100"}
GREY: Final = "#616161"
CHARACTER: Final = 7
"""Pixels of a character, about; `textLength` sees to the rest."""


def badge(report: Report, baseline: Baseline = NONE_KNOWN) -> str:
    """Return the SVG: how many checks that were judged passed; red where a failure is new."""
    judged = [report.count(verdict) for verdict in (Verdict.PASS, Verdict.FAIL)]
    text = f"{judged[0]} of {sum(judged)} pass" if any(judged) else "nothing judged"
    if report.aborted:
        text += ", not all"
    colour = COLOURS.get(baseline.exit_status(report), GREY)
    left, right = (len(words) * CHARACTER + 12 for words in (LABEL, text))
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" \
role="img" aria-label="{LABEL}: {text}">
<title>{LABEL}: {text}</title>
<rect width="{left}" height="20" fill="#444"/>
<rect x="{left}" width="{right}" height="20" fill="{colour}"/>
<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11" text-anchor="middle">
<text x="{left // 2}" y="14" textLength="{left - 12}">{LABEL}</text>
<text x="{left + right // 2}" y="14" textLength="{right - 12}">{text}</text>
</g>
</svg>
"""
