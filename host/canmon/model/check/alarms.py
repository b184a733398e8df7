"""Rules held against traffic while it goes on: what is broken now, and what was."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.canmon.model.check.rules import NO_LOSS, Rules
from tickrig.host.canmon.model.frames import Record, s_text

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded

RECENT_US: Final = 2_000_000
"""A rule that a frame broke counts as broken for so long."""

GRACE_US: Final = 2_000_000
"""What has never come is missed only after so long."""

LATE_US: Final = 1_000_000
"""What has not come in time may still be on its way through this machine for so long."""

KEPT: Final = 1_000
"""Findings that are kept."""


class AlarmState(StrEnum):
    """How a rule stands."""

    HOLDS = "holds"
    BROKEN = "BROKEN"
    WAS_BROKEN = "was broken"  # until somebody acknowledges it


@dataclass(slots=True)
class Alarm:
    """One rule.

    Attributes:
        rule: its name.
        count: findings, a lasting one counted once.
        finding: the latest.
        lasting: it is broken by what is missing.
        acknowledged: somebody has seen how it was broken last.
    """

    rule: str
    count: int = 0
    finding: TrafficFinding | None = None
    lasting: bool = False
    acknowledged: bool = True

    def state(self, now_us: int) -> AlarmState:
        """Return how it stands."""
        if self.finding is None:
            return AlarmState.HOLDS
        if self.lasting or now_us - self.finding.at_us < RECENT_US:
            return AlarmState.BROKEN
        return AlarmState.HOLDS if self.acknowledged else AlarmState.WAS_BROKEN


@dataclass(slots=True)
class Alarms:
    """Holds frames against rules as they come.

    Args:
        rules: what must hold.
        bit_rate: bits a second, for the load.
        data_bit_rate: of data of CAN FD frames with BRS.

    Attributes:
        findings: the latest, oldest first.
        judged: a frame was held against the rules.

    Raises:
        ValueError: a limit of the load without a bit rate.
    """

    rules: Rules
    bit_rate: int | None = None
    data_bit_rate: int | None = None
    findings: deque[TrafficFinding] = field(init=False)
    judged: bool = field(init=False)
    _checker: Checker = field(init=False)
    _alarms: dict[str, Alarm] = field(init=False)
    _begin_us: int | None = field(init=False)
    _lost: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        """Begin with rules that hold."""
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._checker = Checker(self.rules, self.bit_rate, self.data_bit_rate)
        self._alarms = {name: Alarm(name) for name in self.rules.names()}
        self.findings = deque(maxlen=KEPT)
        self._begin_us, self.judged = None, False

    def take(self, record: Record, decoded: Decoded | None = None) -> None:
        """Hold a frame, and what it says, against the rules."""
        self.judged = True
        for finding in self._checker.take(record, decoded):
            self._found(finding)

    def check_missing(self, now_us: int, lost: int = 0) -> None:
        """See what is missing now.

        Args:
            now_us: the time of the frames.
            lost: frames that were lost until now.
        """
        if self._begin_us is None:
            self._lost = lost
        # Before the first frame the time is this machine's; the first frame may have an
        # earlier one.
        if self._begin_us is None or now_us < self._begin_us:  # until a frame has told its time
            self._begin_us = now_us
        if lost > self._lost and self.rules.no_loss:
            self._found(TrafficFinding(now_us, NO_LOSS, f"{lost - self._lost} frames were lost"))
        self._lost = lost
        for finding in self._checker.advance(now_us - LATE_US):
            self._found(finding)
        if now_us - self._begin_us >= GRACE_US:
            self._miss(self._checker.missing(now_us))

    def rows(self) -> list[Alarm]:
        """Return all rules in their order."""
        return list(self._alarms.values())

    def broken(self, now_us: int) -> int:
        """Count the rules that are broken now."""
        return sum(alarm.state(now_us) is AlarmState.BROKEN for alarm in self._alarms.values())

    def acknowledge(self) -> None:
        """Take note of all that was broken."""
        for alarm in self._alarms.values():
            alarm.acknowledged = True

    def _miss(self, missing: list[TrafficFinding]) -> None:
        """Note what is missing: once, however long it lasts."""
        for alarm in self._alarms.values():
            finding = _joined([one for one in missing if one.rule == alarm.rule])
            if finding is None:
                alarm.lasting = False
            elif alarm.lasting:
                alarm.finding = finding
            else:
                self._found(finding)
                alarm.lasting = True

    def _found(self, finding: TrafficFinding) -> None:
        alarm = self._alarms[finding.rule]
        alarm.count += 1
        alarm.finding, alarm.acknowledged = finding, False
        self.findings.append(finding)


def _joined(findings: list[TrafficFinding]) -> TrafficFinding | None:
    if not findings:
        return None
    return findings[0]._replace(text="; ".join(one.text for one in findings))


RULE: Final = "RULE"
_RULE_WIDTHS: Final = (20, 40)
"""The first column, and how wide it is at least and at most."""

_NO_FRAME: Final = "no frame"
"""The state of a rule that does not hold yet: nothing came."""


def render_alarms(alarms: Alarms, now_us: int) -> list[str]:
    """Return a line for each rule below a head, then the findings, the latest first."""
    rows = alarms.rows()
    least, most = _RULE_WIDTHS
    width = min(most, max([least, *(len(alarm.rule) for alarm in rows)]))
    head = f"{RULE:<{width}} {'STATE':<10} {'COUNT':>6} {'AGO':>8}  LATEST"
    lines = [head, *(_line(alarm, now_us, alarms.judged, width) for alarm in rows)]
    found = [str(finding) for finding in reversed(alarms.findings)]
    return [*lines, "", f"FINDINGS, latest first: {len(found)}", *found]


def _line(alarm: Alarm, now_us: int, judged: bool, width: int) -> str:
    state, finding = str(alarm.state(now_us)), alarm.finding
    if state == AlarmState.HOLDS and not judged:
        state = _NO_FRAME
    ago = "" if finding is None else f"{s_text(now_us - finding.at_us)} s"
    text = "" if finding is None else finding.text
    name = alarm.rule if len(alarm.rule) <= width else f"{alarm.rule[: width - 1]}…"
    return f"{name:<{width}} {state:<10} {alarm.count:>6} {ago:>8}  {text}".rstrip()
