"""Findings as SARIF 2.1.0 (OASIS), which code hosts and editors show."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Final
from urllib.parse import quote

from tickrig.host.canmon.model.check.junit import NONE_SKIPPED
from tickrig.host.canmon.model.check.rule import Finding

SCHEMA: Final = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)


def sarif(
    source: str,
    names: Sequence[str],
    findings: Iterable[Finding],
    unjudged: str = "",
    skipped: Mapping[str, str] = NONE_SKIPPED,
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
    report = {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}
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


def _result(uri: str, finding: Finding, place: int) -> dict[str, object]:
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
