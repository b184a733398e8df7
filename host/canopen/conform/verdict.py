"""The results of a check, and of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.check import Check, Level


class CheckVerdict(StrEnum):
    """The verdict of a check."""

    PASS = "pass"
    FAIL = "fail"
    NOT_APPLICABLE = "not applicable"
    IMPLEMENTATION_DEFINED = "implementation-defined"
    INCONCLUSIVE = "inconclusive"
    """The bus or this host was too slow or lost frames, or another node interfered."""
    BLOCKED = "blocked"
    """The node did not answer again."""


class Direction(StrEnum):
    """The direction of a line of the evidence."""

    SENT = ">"
    RECEIVED = "<"
    REMARK = "#"


class FrameLine(NamedTuple):
    """One line of the recorded evidence of a check: a frame on the bus, or a remark of the tester.

    Attributes:
        at_us: bus time since the start of the run, in microseconds.
        direction: `SENT` for a frame that the tester sent, `RECEIVED` for a frame that the tester
            received, or `REMARK` for a remark.
        text: frame in candump notation, or the text of the remark.
    """

    at_us: int
    direction: Direction
    text: str


@dataclass(frozen=True, slots=True)
class CheckOutcome:
    """Verdict and evidence of one attempt at a check.

    Attributes:
        verdict: verdict of the attempt.
        reason: explanation of the verdict in one line, with the received and the expected frames.
            It is empty if the check passed.
        evidence: frames on the bus and remarks of the tester.
        start_us: bus time at the start of the attempt, in microseconds since the start of the run.
        end_us: bus time at the end of the attempt, in microseconds since the start of the run.
        wanted: patterns of the correct frames, if the attempt failed because of a wrong or missing
            frame.
    """

    verdict: CheckVerdict
    reason: str = ""
    evidence: tuple[FrameLine, ...] = ()
    start_us: int = 0
    end_us: int = 0
    wanted: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Result:
    """Result of one check in a run.

    Attributes:
        check: check to which the result belongs.
        outcome: attempt that decides the verdict.
        first: attempt before `outcome`, or None if the check was not repeated.
    """

    check: Check
    outcome: CheckOutcome
    first: CheckOutcome | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """The report of a whole run.

    Attributes:
        source: name of the bus, as the user entered it.
        node_id: node-ID of the node, 1..127.
        level: highest level of the actions that the run was allowed to do.
        results: results in the order of the run.
        node: properties that the node reports (1000h, 1008h to 100Ah, 1018h), by name, in words.
        settings: adapter, bit rate, tolerances, seed, versions and so on, by name, in words.
        findings: findings in the EDS, and contradictions between EDS and node, one per line.
        unrestored: objects that could not be restored, one per line.
        repairs: writes that restore these objects, in this order, as arguments of `canmon net
            SOURCE write NODE`.
        duration_us: duration of the run, in bus time.
        aborted: reason why the run ended early, empty if the run was complete.
        doubt: reason to doubt that the report is about the node, empty without a doubt.
        absent: whether no check was judged, because no node, or more than one node, answers to the
            node-ID.
    """

    source: str
    node_id: int
    level: Level
    results: tuple[Result, ...] = field(repr=False)
    node: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict, repr=False)
    findings: tuple[str, ...] = ()
    unrestored: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()
    duration_us: int = 0
    aborted: str = ""
    doubt: str = ""
    absent: bool = False

    def with_verdict(self, *verdicts: CheckVerdict) -> list[Result]:
        """Return the results that have one of the given verdicts, in the order of the run."""
        return [result for result in self.results if result.outcome.verdict in verdicts]

    def count(self, verdict: CheckVerdict) -> int:
        """Return the number of checks with this verdict."""
        return len(self.with_verdict(verdict))

    @property
    def exit_status(self) -> int:
        """Exit status of `canmon conform` for this report (conform.md 5).

        The status is 0 if all checks pass, 1 if a check failed, 4 if a check is inconclusive or
        blocked or the run ended early, and 5 if no check has a verdict.
        """
        return self.exit_status_with(self.count(CheckVerdict.FAIL))

    def exit_status_with(self, failures: int) -> int:
        """Return the exit status of the run if this number of failures counts."""
        if failures:
            return FAILED
        if self.aborted or self.with_verdict(CheckVerdict.INCONCLUSIVE, CheckVerdict.BLOCKED):
            return UNDECIDED
        return 0 if self.with_verdict(CheckVerdict.PASS, CheckVerdict.FAIL) else NOTHING_JUDGED


FAILED: Final = 1
UNDECIDED: Final = 4
NOTHING_JUDGED: Final = 5
BUS_FAILED: Final = 3
CTRL_C: Final = 130
INTERRUPTED: Final = "interrupted"
"""Reason why a run ended early, if the user ended it."""
