"""What `check` finds, shown as it comes: as text, or as objects in JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial

import click

from tickrig.host.canmon.errors import until_unread
from tickrig.host.canmon.model.check.checker import Unjudged
from tickrig.host.canmon.model.check.rule import Finding
from tickrig.host.canmon.model.frames.dump_line import DumpLines, Stamp, decoded_text
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import counted


class Verdict:
    """Findings, shown as they come.

    Args:
        jsonl: show them as JSON.
        stamp: how times are shown as text; None for seconds of the epoch.
        kept: a report will want them.
        rules: the names of all rules.

    Attributes:
        counts: how many there are, by rule.
        findings: all of them, where they are kept.
        frames: how many were held against the rules.
        unjudged: what the rules could not judge, once all is over.
    """

    unjudged = Unjudged({})

    def __init__(
        self, jsonl: bool, stamp: Stamp | None = None, *, kept: bool, rules: Sequence[str] = ()
    ) -> None:
        self._rules = rules
        self.counts: Counter[str] = Counter()
        self.findings: list[Finding] = []
        self.frames = self._shown = 0
        self._lines = None if stamp is None else DumpLines(stamp)
        self._text = finding_json if jsonl else partial(Finding.shown, lines=self._lines)
        self._kept = kept

    def count(self, frames: int, first_us: int) -> None:
        """Count frames; the first of all is where times may begin.

        Args:
            frames: at least one.
            first_us: when the first of them was.
        """
        if self._lines is not None and not self.frames:
            self._lines.stamp(first_us)
        self.frames += frames

    def begin_again(self) -> None:
        """Forget all but how many findings were shown: those come first again, and are not."""
        self._shown = self.counts.total()
        self.counts.clear()
        self.findings.clear()
        self.frames = 0

    def take(self, findings: Sequence[Finding]) -> None:
        """Show findings."""
        self.counts.update(finding.rule for finding in findings)
        self.findings += findings if self._kept else ()
        new = findings[self._shown :]
        self._shown -= len(findings) - len(new)
        if new:
            with until_unread():
                click.echo("\n".join(map(self._text, new)))

    def nothing_judged(self) -> str:
        """Say why no rule judged anything; empty if one did."""
        none = self.none_judged
        if any(name not in none for name in self._rules):
            return ""
        return f"nothing was judged: {'; '.join(f'{name}: {why}' for name, why in none.items())}"

    @property
    def none_judged(self) -> dict[str, str]:
        """Why rules judged nothing, by their names; one that found something did."""
        return {name: why for name, why in self.unjudged.rules.items() if name not in self.counts}

    def doubts(self) -> list[str]:
        """Say what was not judged, one line each."""
        none = [f"{name} judged nothing: {why}" for name, why in self.none_judged.items()]
        return none + [f"not judged: {text}" for text in self.unjudged.notes]

    def summary(self) -> str:
        """Say how it ended."""
        if self.counts:
            counts = ", ".join(f"{rule}: {count}" for rule, count in sorted(self.counts.items()))
            return f"{counted(self.counts.total(), 'finding')}: {counts}"
        none = len(self.none_judged)
        if not none:
            return "all rules hold"
        return f"{counted(len(self._rules) - none, 'rule')} held, {none} judged nothing"


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
    return json_text(said, letters=True)


def _frame(record: Record) -> dict[str, str]:
    return {"ch": record.channel, "frame": str(record.frame)}
