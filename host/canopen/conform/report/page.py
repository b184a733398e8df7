"""A conformance run as one self-contained HTML page."""

from __future__ import annotations

from functools import cache
from typing import Final

from tickrig.host.canopen.conform.notation import step_words
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.overview import (
    SAME,
    UNWELL,
    ShowFrames,
    by_clause,
    by_group,
    counts_text,
    cut,
    hint,
    plain_frames,
    repair_commands,
    same_go,
    unwell,
    verdict_counts,
)
from tickrig.host.canopen.conform.suite import group_titles
from tickrig.host.canopen.conform.verdict import CheckOutcome, CheckVerdict, Report
from tickrig.host.text.html_page import PageTemplate

_MOST_LINES: Final = 200
"""Number of lines that are shown of one attempt at a check."""
_MOST_OPEN: Final = 12
"""Number of failures that are unfolded at once."""


def html_page(
    report: Report, baseline: Baseline = NONE_KNOWN, show: ShowFrames = plain_frames
) -> str:
    """Return a conformance report as one HTML page. Equal reports give equal bytes.

    Args:
        report: report of the run.
        baseline: failures that are known.
        show: function that formats the recorded frames as lines.
    """

    def frames(outcome: CheckOutcome) -> str:
        return "\n".join(cut(show(outcome.evidence), _MOST_LINES))

    found = unwell(report)
    return _template().render(
        repairs=repair_commands(report),
        report=report,
        baseline=baseline,
        mended=baseline.mended(report),
        counts=verdict_counts(report.results),
        groups=by_group(report),
        titles=group_titles(),
        clauses=by_clause(report),
        unwell=found,
        opened=len(found) <= _MOST_OPEN,
        frames=frames,
    )


@cache
def _template() -> PageTemplate:
    """Return the template. The template is compiled once."""
    names = {
        "counts": counts_text,
        "slug": lambda verdict: verdict.name.lower(),
        "hint": hint,
        "words": step_words,
        "Verdict": CheckVerdict,
        "UNWELL": UNWELL,
        "same_go": same_go,
        "SAME": SAME,
    }
    return PageTemplate(__package__, names)
