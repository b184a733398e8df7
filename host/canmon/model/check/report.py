"""Findings as a JUnit report, and as SARIF 2.1.0 (OASIS), which code hosts and editors show."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, Protocol
from urllib.parse import quote
from xml.sax.saxutils import escape, quoteattr

from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.text.values import counted

# Findings as a JUnit report, one test case for each rule.

_CONTROLS: Final = {code: "�" for code in range(0x20) if chr(code) not in "\t\n\r"}
"""Characters that XML does not have."""


_NONE_SKIPPED: Final[Mapping[str, str]] = MappingProxyType({})


class Judged(Protocol):
    """What a report needs of a finding, beside its text in one line."""

    @property
    def rule(self) -> str:
        """Name of the rule."""
        ...

    @property
    def text(self) -> str:
        """What is wrong, in words."""
        ...


def junit(
    suite: str,
    names: Sequence[str],
    findings: Iterable[Judged],
    unjudged: str = "",
    skipped: Mapping[str, str] = _NONE_SKIPPED,
) -> str:
    """Return the report.

    Args:
        suite: what was checked.
        names: of all rules, also of those that hold.
        findings: in their order.
        unjudged: why rules without a finding cannot be said to hold; empty if they can.
        skipped: why some rules judged nothing, by their names.
    """
    by_rule: dict[str, list[Judged]] = {name: [] for name in names}
    for finding in findings:
        by_rule[finding.rule].append(finding)
    failures = sum(bool(found) for found in by_rule.values())
    errors = len(by_rule) - failures if unjudged else 0
    counts = f"tests='{len(names)}' failures='{failures}' errors='{errors}'"
    skips = {} if unjudged else skipped
    counts += f" skipped='{len(skips)}'" * bool(skips)
    head = f"<testsuite name={_attribute(suite)} {counts}>"
    cases = [
        _case(suite, name, found, unjudged, skips.get(name, "")) for name, found in by_rule.items()
    ]
    lines = ["<?xml version='1.0' encoding='utf-8'?>", "<testsuites>", head, *cases]
    return "\n".join([*lines, "</testsuite>", "</testsuites>", ""])


def _case(suite: str, name: str, found: Sequence[Judged], unjudged: str, skipped: str) -> str:
    head = f"<testcase classname={_attribute(suite)} name={_attribute(name)}"
    if not found:
        kind, why = ("error", unjudged) if unjudged else ("skipped", skipped)
        return head + (f"><{kind} message={_attribute(why)}/></testcase>" if why else "/>")
    message = f"{counted(len(found), 'finding')}, first: {found[0].text}"
    text = escape("\n".join(map(str, found)).translate(_CONTROLS))
    return f"{head}><failure message={_attribute(message)}>{text}</failure></testcase>"


def _attribute(text: str) -> str:
    return quoteattr(text.translate(_CONTROLS))


# Findings as SARIF 2.1.0 (OASIS), which code hosts and editors show.

_SCHEMA: Final = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)


def sarif(
    source: str,
    names: Sequence[str],
    findings: Iterable[TrafficFinding],
    unjudged: str = "",
    skipped: Mapping[str, str] = _NONE_SKIPPED,
) -> str:
    """Return the report.

    A finding has no line: a log is read as frames. Its time, bus and frame are properties; the
    frames around it are related locations.

    Args:
        source: what was checked, as a file or bus.
        names: of all rules.
        findings: in their order.
        unjudged: why rules without a finding cannot be said to hold; empty if they can.
        skipped: why some rules judged nothing, by their names.
    """
    uri = quote(source.encode("utf-8", "surrogateescape"))
    places = {name: place for place, name in enumerate(names)}
    driver = {"name": "canmon check", "rules": [{"id": name} for name in names]}
    run = {
        "tool": {"driver": driver},
        "invocations": [_invocation(unjudged, skipped)],
        "results": [_result(uri, finding, places[finding.rule]) for finding in findings],
    }
    report = {"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}
    return json.dumps(report, ensure_ascii=False, indent=1) + "\n"


def _invocation(unjudged: str, skipped: Mapping[str, str]) -> dict[str, object]:
    said: dict[str, object] = {"executionSuccessful": not unjudged}
    notes = [("error", unjudged)] if unjudged else []
    notes += [("warning", f"{name} judged nothing: {why}") for name, why in skipped.items()]
    if notes:
        said["toolExecutionNotifications"] = [
            {"level": level, "message": {"text": text}} for level, text in notes
        ]
    return said


def _result(uri: str, finding: TrafficFinding, place: int) -> dict[str, object]:
    properties: dict[str, object] = {"t": finding.at_us / 1e6}
    if finding.record is not None:
        properties |= {"ch": finding.record.channel, "frame": str(finding.record.frame)}
    text, *around = str(finding).splitlines()
    where = {"physicalLocation": {"artifactLocation": {"uri": uri}}}
    related = [{**where, "message": {"text": line.strip()}} for line in around]
    return {
        "ruleId": finding.rule,
        "ruleIndex": place,
        "level": "error",
        "message": {"text": text.partition(f"{finding.rule}: ")[2]},
        "locations": [where],
        **({"relatedLocations": related} if related else {}),
        "properties": properties,
    }
