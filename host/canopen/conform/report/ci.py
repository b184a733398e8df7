"""A report as JUnit, for what shows the tests of CI: one suite a group, one case a check."""

from __future__ import annotations

from collections.abc import Mapping
from math import fsum
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.overview import (
    ShowFrames,
    all_goes,
    by_group,
    cut,
    plain_frames,
)
from tickrig.host.canopen.conform.verdict import FAILED, UNDECIDED, CheckVerdict, Report, Result
from tickrig.host.text.page_text import harmless

# A badge for a README: how many checks passed, as SVG.

_LABEL: Final = "CANopen"
_COLOURS: Final = {0: "#2e7d32", FAILED: "#c62828", UNDECIDED: "#8a6100"}
_GREY: Final = "#616161"
_CHARACTER: Final = 7
"""Pixels of a character, about; `textLength` sees to the rest."""


def badge(report: Report, baseline: Baseline = NONE_KNOWN) -> str:
    """Return the SVG: how many checks that were judged passed; red where a failure is new."""
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
"""Of a case."""

_TAGS: Final[Mapping[CheckVerdict, str]] = {
    CheckVerdict.FAIL: "failure",
    CheckVerdict.INCONCLUSIVE: "error",
    CheckVerdict.BLOCKED: "error",
    CheckVerdict.NOT_APPLICABLE: "skipped",
    CheckVerdict.IMPLEMENTATION_DEFINED: "system-out",
}


def report_junit(
    report: Report, baseline: Baseline = NONE_KNOWN, show: ShowFrames = plain_frames
) -> str:
    """Return the report; a known failure is skipped, what could not be judged is an error.

    Args:
        report: the run.
        baseline: failures that are known.
        show: writes frames.
    """
    root = Element("testsuites", name=harmless(f"node {report.node_id} on {report.source}"))
    for row in by_group(report):
        suite = SubElement(root, "testsuite", name=harmless(row.name))
        for result in row.results:
            _add_case(suite, result, baseline, show)
    if report.aborted:
        suite = SubElement(root, "testsuite", name="run")
        case = SubElement(suite, "testcase", classname="run", name="comes to its end", time="0")
        SubElement(case, "error", message=harmless(report.aborted))
    for suite in root:
        _count(suite)
    _add_properties(root, report)
    indent(root, " ")
    return "<?xml version='1.0' encoding='utf-8'?>\n" + tostring(root, "unicode") + "\n"


def _add_case(suite: Element, result: Result, baseline: Baseline, show: ShowFrames) -> None:
    check, outcome = result.check, result.outcome
    seconds = f"{(outcome.end_us - outcome.start_us) / 1e6:.6f}"
    name = harmless(f"{check.id} {check.title}")
    case = SubElement(suite, "testcase", classname=harmless(check.group), name=name, time=seconds)
    known = baseline.knows(result)
    tag = "skipped" if known else _TAGS.get(outcome.verdict)
    if tag is None:
        return
    reason = f"{'known failure: ' if known else ''}{outcome.reason or outcome.verdict}"
    told = SubElement(case, tag) if tag == "system-out" else None
    lines = [reason] if tag in ("skipped", "system-out") else _lines(result, show)
    if told is None:
        told = SubElement(case, tag, message=harmless(f"{reason} ({check.source})"))
    if tag != "skipped":
        told.text = harmless("\n".join(lines))


def _lines(result: Result, show: ShowFrames) -> list[str]:
    return [result.check.source, *cut(all_goes(result.outcome, result.first, show), _MOST_LINES)]


def _count(suite: Element) -> None:
    suite.set("tests", str(len(suite)))
    for name, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(name, str(sum(case.find(tag) is not None for case in suite)))
    suite.set("time", f"{fsum(float(case.get('time', '0')) for case in suite):.6f}")


def _add_properties(root: Element, report: Report) -> None:
    """Say in the first suite what was judged, and how."""
    if not len(root):
        return
    told = {"level": report.level.word, **report.node, **report.settings}
    told |= {"doubt": report.doubt} if report.doubt else {}
    told |= {f"finding {number}": text for number, text in enumerate(report.findings, 1)}
    told |= {f"not restored {number}": text for number, text in enumerate(report.unrestored, 1)}
    properties = Element("properties")
    for name, value in told.items():
        SubElement(properties, "property", name=harmless(name), value=harmless(value))
    root[0].insert(0, properties)
