"""A report as JUnit for CI systems: one suite per group, one case per check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from tickrig.host.canopen.conform.report import overview
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.verdict import FAILED, UNDECIDED, CheckVerdict, Report, Result
from tickrig.host.text import junit

# A badge for a README: how many checks pass, as SVG.

_LABEL: Final = "CANopen"
_COLOURS: Final = {0: "#2e7d32", FAILED: "#c62828", UNDECIDED: "#8a6100"}
_GREY: Final = "#616161"
_CHARACTER: Final = 7
"""Approximate width of a character in pixels. `textLength` scales the text to fit."""


def badge(report: Report, baseline: Baseline = NONE_KNOWN) -> str:
    """Return an SVG badge for a README that shows how many checks passed, such as `77 of 78 pass`.

    The badge is red if a failure is not in the baseline.
    """
    judged = [report.count(verdict) for verdict in (CheckVerdict.PASS, CheckVerdict.FAIL)]
    text = f"{judged[0]} of {sum(judged)} pass" if any(judged) else "nothing judged"
    if report.aborted:
        text += ", not all"
    colour = _COLOURS.get(baseline.exit_status(report), _GREY)
    left, right = (len(words) * _CHARACTER + 12 for words in (_LABEL, text))
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" \
role="img" aria-label="{_LABEL}: {text}">
<title>{_LABEL}: {text}</title>
<rect width="{left}" height="20" fill="#444"/>
<rect x="{left}" width="{right}" height="20" fill="{colour}"/>
<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11" text-anchor="middle">
<text x="{left // 2}" y="14" textLength="{left - 12}">{_LABEL}</text>
<text x="{left + right // 2}" y="14" textLength="{right - 12}">{text}</text>
</g>
</svg>
"""


_MOST_LINES: Final = 200
"""Number of lines that are shown of one case."""

_TAGS: Final[Mapping[CheckVerdict, str]] = {
    CheckVerdict.FAIL: junit.FAILURE,
    CheckVerdict.INCONCLUSIVE: junit.ERROR,
    CheckVerdict.BLOCKED: junit.ERROR,
    CheckVerdict.NOT_APPLICABLE: junit.SKIPPED,
    CheckVerdict.IMPLEMENTATION_DEFINED: junit.OUTPUT,
}


def report_junit(
    report: Report,
    baseline: Baseline = NONE_KNOWN,
    show: overview.ShowFrames = overview.plain_frames,
) -> str:
    """Return a conformance report as JUnit XML for CI systems.

    A known failure is reported as skipped, and a check without a verdict as an error.

    Args:
        report: report of the run.
        baseline: failures that are known.
        show: function that formats the recorded frames as lines.
    """
    suites = [
        junit.JunitSuite(row.name, [_case(result, baseline, show) for result in row.results])
        for row in overview.by_group(report)
    ]
    if report.aborted:
        ended = junit.JunitCase(
            "run", "comes to its end", junit.ERROR, report.aborted, duration_us=0
        )
        suites.append(junit.JunitSuite("run", [ended]))
    if suites:
        suites[0] = replace(suites[0], properties=_properties(report))
    return junit.junit_text(suites, f"node {report.node_id} on {report.source}")


def _case(result: Result, baseline: Baseline, show: overview.ShowFrames) -> junit.JunitCase:
    check, outcome = result.check, result.outcome
    known = baseline.knows(result)
    tag = junit.SKIPPED if known else _TAGS.get(outcome.verdict, "")
    reason = f"{'known failure: ' if known else ''}{outcome.reason or outcome.verdict}"
    text = {junit.SKIPPED: "", junit.OUTPUT: reason}.get(tag)
    return junit.JunitCase(
        *(check.group, f"{check.id} {check.title}", tag, f"{reason} ({check.source})"),
        "\n".join(_lines(result, show)) if text is None and tag else text or "",
        outcome.end_us - outcome.start_us,
    )


def _lines(result: Result, show: overview.ShowFrames) -> list[str]:
    return [
        result.check.source,
        *overview.cut(overview.all_goes(result.outcome, result.first, show), _MOST_LINES),
    ]


def _properties(report: Report) -> dict[str, str]:
    """Return properties: the judged node and the settings of the run."""
    told = {"level": report.level.word, **report.node, **report.settings}
    told |= {"doubt": report.doubt} if report.doubt else {}
    told |= {f"finding {number}": text for number, text in enumerate(report.findings, 1)}
    told |= {f"not restored {number}": text for number, text in enumerate(report.unrestored, 1)}
    return told
