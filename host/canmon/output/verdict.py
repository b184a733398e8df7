"""What `check` finds, shown as it comes: as text, or as objects in JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence

import click

from tickrig.host.canmon.errors import until_unread
from tickrig.host.monitor.check.rule import Finding
from tickrig.host.monitor.frames.dump_line import decoded_text
from tickrig.host.monitor.frames.record import Record


class Verdict:
    """Findings, shown as they come.

    Attributes:
        findings: all of them.
        frames: how many were held against the rules.
    """

    def __init__(self, jsonl: bool) -> None:
        self.findings: list[Finding] = []
        self.frames = 0
        self._text = finding_json if jsonl else str

    def take(self, findings: Sequence[Finding]) -> None:
        """Show findings."""
        if findings:
            self.findings += findings
            with until_unread():
                click.echo("\n".join(map(self._text, findings)))

    def summary(self) -> str:
        """Say how it ended."""
        if not self.findings:
            return "all rules hold"
        rules = Counter(finding.rule for finding in self.findings)
        counts = ", ".join(f"{rule}: {count}" for rule, count in sorted(rules.items()))
        return f"{len(self.findings)} findings: {counts}"


def finding_json(finding: Finding) -> str:
    """Write a finding as an object; frames as candump does."""
    said: dict[str, object] = {
        "v": 1,
        "t": finding.at_us / 1e6,
        "rule": finding.rule,
        "text": finding.text,
    }
    if finding.record is not None:
        said |= _frame(finding.record)
    if finding.around:
        said["around"] = [
            {"t": record.at_us / 1e6, **_frame(record), "text": decoded_text(decoded)}
            for record, decoded in finding.around
        ]
    return json.dumps(said, ensure_ascii=False)


def _frame(record: Record) -> dict[str, str]:
    return {"ch": record.channel, "frame": str(record.frame)}
