"""A report as JUnit, for what shows the tests of CI: one suite a group, one case a check."""

from __future__ import annotations

from collections.abc import Mapping
from math import fsum
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.evidence import (
    ShowFrames,
    all_goes,
    cut,
    plain_frames,
)
from tickrig.host.canopen.conform.report.overview import by_group
from tickrig.host.canopen.conform.verdict import Report, Result, Verdict
from tickrig.host.text.page_text import harmless

MOST_LINES: Final = 200
"""Of a case."""

TAGS: Final[Mapping[Verdict, str]] = {
    Verdict.FAIL: "failure",
    Verdict.INCONCLUSIVE: "error",
    Verdict.BLOCKED: "error",
    Verdict.NOT_APPLICABLE: "skipped",
    Verdict.IMPLEMENTATION_DEFINED: "system-out",
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
    tag = "skipped" if known else TAGS.get(outcome.verdict)
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
    return [result.check.source, *cut(all_goes(result.outcome, result.first, show), MOST_LINES)]


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
