"""Findings as a JUnit report, and as SARIF 2.1.0 (OASIS) for code hosts and editors."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, Protocol
from urllib.parse import quote

from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.text.junit import ERROR, FAILURE, SKIPPED, JunitCase, JunitSuite, junit_text
from tickrig.host.text.values import counted

# Findings as a JUnit report, one test case for each rule.

_NONE_SKIPPED: Final[Mapping[str, str]] = MappingProxyType({})


class Judged(Protocol):
    """The properties of a finding that a report needs besides the text."""

    @property
    def rule(self) -> str:
        """Name of the rule."""

    @property
    def text(self) -> str:
        """Description of the violation."""


def junit(
    suite: str,
    names: Sequence[str],
    findings: Iterable[Judged],
    unjudged: str = "",
    skipped: Mapping[str, str] = _NONE_SKIPPED,
) -> str:
    """Return the findings of a check as a JUnit report in XML, with one test case for each rule.

    Args:
        suite: name of the test suite, which is the checked log or bus.
        names: names of all checked rules, including those without a finding.
        findings: findings in their order.
        unjudged: reason why the whole check is incomplete, so that no rule counts as passed. Each
            rule without a finding is then marked as an error. The text is empty if the check is
            complete.
        skipped: reason why a single rule could not be judged, by name of the rule. In a complete
            check, the test case of such a rule is marked as skipped.
    """
    by_rule: dict[str, list[Judged]] = {name: [] for name in names}
    for finding in findings:
        by_rule[finding.rule].append(finding)
    cases = []
    for name, found in by_rule.items():
        if found:
            message = f"{counted(len(found), 'finding')}, first: {found[0].text}"
            text = "\n".join(map(str, found))
            cases.append(JunitCase(suite, name, FAILURE, message, text))
        else:
            tag, why = (ERROR, unjudged) if unjudged else (SKIPPED, skipped.get(name, ""))
            cases.append(JunitCase(suite, name, tag if why else "", why))
    return junit_text([JunitSuite(suite, cases)])


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
    """Return the findings of a check as a SARIF report in JSON.

    A finding has no line number in the report, because a log is read as frames and not as lines.
    Instead, the report contains its time, bus and frame as properties, and the frames around it as
    related locations.

    Args:
        source: path of the log, or name of the bus, that was checked.
        names: names of all checked rules, including those without a finding.
        findings: findings in their order.
        unjudged: reason why rules without a finding do not count as passed, or empty if they count
            as passed.
        skipped: reason why a rule could not be judged, by name of the rule.
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
