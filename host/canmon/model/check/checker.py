"""Checks of rules against frames, one frame at a time.

>>> from tickrig.wire.can import CanFrame
>>> checker = Checker(Rules(no_emcy=True))
>>> for finding in checker.take(Record(5, "can0", CanFrame.parse("083#3081110000000000"))):
...     print(finding)
(0.000005) no-emcy: node 3: EMCY 8130h life guard error or heartbeat error [can0 083#3081110000000000]
"""  # noqa: E501 - as it is printed

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model.check.rule import (
    ONE_TIME,
    CheckedTraffic,
    MaxLoad,
    NoErrorFrames,
    NoLostHeartbeat,
    Rule,
    Seen,
    TrafficFinding,
)
from tickrig.host.canmon.model.check.rules import NO_EDS, NO_LOSS, EdsHeartbeats, Rules
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames import ERROR, AnyFrame, Record, any_ident, s_text
from tickrig.host.canmon.model.traffic import LEAST_WINDOW_US, BitRates, BusSecond, Load
from tickrig.wire.can import ErrorFrame, FdFrame, frame_bits

if TYPE_CHECKING:
    from tickrig.host.canmon.model.check.rule_parser import ExpressionRule
    from tickrig.host.canmon.model.decode.decoder import Decoder


# Theory of operation
# ===================
#
# There are three kinds of rules and two ways to check traffic.
#
# Kinds: `Rule` sees frames (rule.py, frame_rules.py, time_rules.py), `MaxLoad` sees seconds
# of a bus, `ExpressionRule` sees decoded frames (demands.py). Ways: `Checker` takes frames
# one by one, live or from a log; `ColumnChecker` takes a log in blocks of numpy and passes rules of
# the first two kinds only the frames that they select. Both must report the same findings, in the
# same order: for a frame the load first, then the rules in the order of `Rules.make`, last the
# expressions, which only `Checker` checks. So a rule may keep state only from frames that its
# `selection` names; other frames must not change its findings.
#
# A rule has three methods. `judge` at each frame that it `wants`. `end` at the end, for
# what is missing; it changes nothing, because a live check calls it repeatedly (`missing`).
# `unjudged` last: a rule that judged nothing is no rule that holds, and a report must not count it
# as passed. A new rule needs all three; the base class derives `unjudged` from `wants` and `end`.
#
# Time is that of the frames. `advance` reports what has not come in time; it is called with the
# time of the next frame before that frame is judged, so a missed deadline is reported before the
# late frame.
#
# What is kept grows with identifiers and not with frames: `_seen` has first and last time
# and a count. A gap is never below 0, since clocks of loggers go back; the statistics count how
# often.
#
# Text of findings is read by people and by tests, and is the same for both ways.


class Unjudged(NamedTuple):
    """Rules that a check could not judge, so that they do not count as passed.

    Attributes:
        rules: reason why nothing was judged, by name of the rule.
        notes: texts about rules that could be judged only in part.
    """

    rules: Mapping[str, str]
    notes: tuple[str, ...] = ()


class RuleCheck:
    """Base class of the checkers that compare traffic with rules.

    The subclasses process the frames. This class judges the bus load, and what is known only at the
    end of the traffic, such as missing frames.

    Args:
        rules: rules to check.
        bit_rate: bit rate in bits per second, from which the bus load is calculated. If it is None,
            the bit rate in `rules` is used.
        eds_heartbeats: producer heartbeat times (1017h) from EDS files, in ms, by node-ID.

    Raises:
        ValueError: the rules limit the bus load, but the bit rate is unknown.
    """

    def __init__(self, rules: Rules, bit_rate: int | None, eds_heartbeats: EdsHeartbeats) -> None:
        self._rules, self._made = rules, rules.make(eds_heartbeats)
        self._load, self._begun = rules.load(bit_rate), False

    def _begin(self, at_us: int) -> None:
        self._begun = True
        for rule in self._made:
            rule.begin(at_us)

    def _evidence(self) -> Mapping[tuple[str, int], Seen]:
        """Return the frames of each identifier on each bus."""
        raise NotImplementedError

    def judge_window(self, channel: str, window: BusSecond) -> list[TrafficFinding]:
        """Judge the load of a bus in one second.

        The result is a list with one finding if the load is above the limit, otherwise an empty
        list.

        Args:
            channel: name of the bus.
            window: start of a period of one second, and the number of bits on the bus in this
                period.
        """
        text = self._load.judge(channel, window) if self._load else None
        return [] if text is None else [TrafficFinding(window.at_us, "max-load", text)]

    def _ended(
        self,
        loads: Mapping[str, Load],
        end_us: int,
        lost: Iterable[str] = (),
        errors: Iterable[str] = (),
    ) -> list[TrafficFinding]:
        """Return the violations at the end: open seconds, missing frames, reports of the source."""
        found = []
        for channel, load in sorted(loads.items()):
            found += self.judge_window(channel, load.end(end_us))
        latest_us: dict[int, int] = {}
        for (_, ident), seen in self._evidence().items():
            latest_us[ident] = max(seen.last_us, latest_us.get(ident, seen.last_us))
        found += [
            TrafficFinding(end_us, rule.name, text)
            for rule in self._made
            for text in rule.end(latest_us, end_us)
        ]
        if self._rules.no_error_frames:
            found += [TrafficFinding(end_us, NoErrorFrames.name, text) for text in errors]
        return found + [
            TrafficFinding(end_us, NO_LOSS, text) for text in lost if self._rules.no_loss
        ]

    def _unjudged(
        self, end_us: int, without_errors: str, written: Iterable[ExpressionRule] = ()
    ) -> Unjudged:
        """Return the rules that were not judged, for a source that had a frame."""
        evidence = CheckedTraffic(self._evidence(), end_us, without_errors)
        why = [(rule.name, rule.unjudged(evidence)) for rule in self._made]
        why += [(rule.name, rule.unjudged(evidence)) for rule in written]
        if self._rules.max_load is not None:
            no_load = "no frame came" if not evidence.seen else ONE_TIME * evidence.untimed
            why.append((MaxLoad.name, no_load))
        by_name: dict[str, list[str]] = {}
        for name, reason in why:
            by_name.setdefault(name, []).append(reason)
        none = {name: "; ".join(dict.fromkeys(said)) for name, said in by_name.items() if all(said)}
        notes = [
            f"{rule.name}: {text}"
            for rule in self._made
            if rule.name not in none
            for text in rule.notes(evidence)
        ]
        notes += [f"{name}: {text}" for name, text in why if text and name not in none]
        if self._rules.max_load is not None and MaxLoad.name not in none and evidence.is_short:
            notes.append(f"{MaxLoad.name}: the traffic lasts less than {LEAST_WINDOW_US / 1e6:g} s")
        return Unjudged(none, tuple(notes))


class Checker(RuleCheck):
    """Checker that judges frames by rules, one frame at a time, live or from a log.

    The memory that the checker needs grows with the number of CAN-IDs, not with the number of
    frames.

    Args:
        rules: rules to check. Rules that are expressions, such as `181 every 10ms`, need decoded
            frames.
        bit_rate: bit rate in bits per second, from which the bus load is calculated. If it is None,
            the bit rate in `rules` is used.
        data_bit_rate: bit rate in bits per second in the data phase of CAN FD frames with BRS. If
            it is None, the data phase is assumed to have the rate `bit_rate`.
        eds_heartbeats: producer heartbeat times (1017h) from EDS files, in ms, by node-ID.

    Raises:
        ValueError: the rules limit the bus load, but the bit rate is unknown.
    """

    def __init__(
        self,
        rules: Rules,
        bit_rate: int | None = None,
        data_bit_rate: int | None = None,
        eds_heartbeats: EdsHeartbeats = NO_EDS,
    ) -> None:
        super().__init__(rules, bit_rate, eds_heartbeats)
        self._wanting: dict[int, list[Rule]] = {}
        self._seen: dict[tuple[str, int], list[int]] = {}  # first and last time, and how many
        self._loads: dict[str, Load] = {}
        self._expressions = [rule for one in rules.expressions for rule in one.make()]
        self._rates = BitRates(bit_rate or rules.bit_rate, data_bit_rate)

    def take(self, record: Record, decoded: Decoded | None = None) -> list[TrafficFinding]:
        """Check a frame and return the violations that it shows.

        If the frame is the first after a full second, the bus load of that second is checked, too.

        Args:
            record: frame to check.
            decoded: meaning of the frame. Without it, rules that are expressions do not check the
                frame.
        """
        if decoded is None or not self._expressions:
            return self._taken(record)
        found = self.advance(record.at_us) + self._taken(record)
        for rule in self._expressions:
            finding = rule.take(record, decoded)
            if finding is not None:
                found.append(finding)
        return found

    def advance(self, now_us: int) -> list[TrafficFinding]:
        """Return findings about frames that are overdue now, while no frame arrives."""
        late = [rule for rule in self._expressions if rule.due_us < now_us]
        return [one for rule in late for one in rule.advance(now_us)]

    def _taken(self, record: Record) -> list[TrafficFinding]:
        at_us, channel, frame, _ = record
        if not self._begun:
            self._begin(at_us)
        found = self._too_busy(at_us, channel, frame) if self._load else []
        if isinstance(frame, ErrorFrame):
            return found + self._judged(ERROR, record, None)
        ident = any_ident(frame)
        key = channel, ident
        seen, gap_us = self._seen.get(key), None
        if seen is None:
            self._seen[key] = [at_us, at_us, 1]
        else:
            gap_us = max(0, at_us - seen[1])
            seen[1] = at_us
            seen[2] += 1
        return found + self._judged(ident, record, gap_us)

    def end(
        self,
        end_us: int,
        lost: Iterable[str] = (),
        judged_us: int | None = None,
        errors: Iterable[str] = (),
    ) -> list[TrafficFinding]:
        """Return the findings that are known only at the end, such as frames that never arrived.

        Args:
            end_us: time in microseconds at which listening ended.
            lost: messages of the source about lost frames, and about lines of a log that are not
                frames.
            judged_us: time in microseconds up to which the rules written as expressions, such as
                `181 every 10ms`, are checked. None means `end_us`. For a source without a clock,
                such as standard input, give the time of the latest frame.
            errors: messages of the source about bus errors that it did not report as error frames.
        """
        found = self._ended(self._loads, end_us, lost, errors)
        judged_us = end_us if judged_us is None else judged_us
        return found + self.advance(judged_us) + self._written_ended(judged_us)

    def missing(self, now_us: int) -> list[TrafficFinding]:
        """Return findings about frames that are missing now. The check continues."""
        return self._ended({}, now_us) + self._written_ended(now_us)

    def unjudged(self, end_us: int, without_errors: str = "") -> Unjudged:
        """Return the rules that found nothing to check in the traffic, each with the reason.

        Args:
            end_us: time in microseconds at which listening ended.
            without_errors: reason why the source cannot contain error frames. If the source can
                contain error frames, the text is empty.
        """
        return self._unjudged(end_us, without_errors, self._expressions)

    def _evidence(self) -> Mapping[tuple[str, int], Seen]:
        return {key: Seen(*values) for key, values in self._seen.items()}

    def _written_ended(self, end_us: int) -> list[TrafficFinding]:
        return [one for rule in self._expressions for one in rule.end(end_us)]

    def _judged(self, ident: int, record: Record, gap_us: int | None) -> list[TrafficFinding]:
        wanting = self._wanting.get(ident)
        if wanting is None:
            wanting = self._wanting[ident] = [rule for rule in self._made if rule.wants(ident)]
        texts = ((rule.name, rule.judge(record, gap_us)) for rule in wanting)
        return [TrafficFinding(record.at_us, name, text, record) for name, text in texts if text]

    def _too_busy(self, at_us: int, channel: str, frame: AnyFrame) -> list[TrafficFinding]:
        load = self._loads.get(channel)
        if load is None:
            load = self._loads[channel] = Load(at_us)
        if isinstance(frame, ErrorFrame):
            return []
        bits = self._rates.bits(frame) if isinstance(frame, FdFrame) else frame_bits(frame)
        window = load.take(at_us, bits)
        return [] if window is None else self.judge_window(channel, window)


# A checker that decodes frames if a rule needs decoded frames.


# The frames around findings.

_Shown = tuple[Record, Decoded]


@dataclass(slots=True)
class _Waiting:
    """A finding, the frames that are shown with it, and the number of missing further frames."""

    finding: TrafficFinding
    around: list[_Shown]
    wanted: int


class Surroundings:
    """Collector that adds the frames before and after a violation to each finding.

    The collector holds a finding back until the frames after the violation have arrived.

    Args:
        frames: number of frames to add before the violation, and also after it.
        rules: names of the rules whose findings get these frames. Other findings stay unchanged.
    """

    def __init__(self, frames: int, rules: Iterable[str]) -> None:
        self._frames, self._rules = frames, frozenset(rules)
        self._before: deque[_Shown] = deque(maxlen=frames)
        self._waiting: deque[_Waiting] = deque()

    def take(
        self, record: Record, decoded: Decoded, found: Sequence[TrafficFinding]
    ) -> list[TrafficFinding]:
        """Add a frame and the findings that it caused, and return all findings that are complete.

        A finding is complete when enough frames have arrived after it. Findings keep their order.

        Args:
            record: frame that has arrived.
            decoded: meaning of the frame.
            found: findings that the frame caused.
        """
        shown = record, decoded
        for one in self._waiting:
            if one.wanted:
                one.around.append(shown)
                one.wanted -= 1
        for finding in found:
            self._add(finding, shown)
        self._before.append(shown)
        return self._complete()

    def flush(self, found: Sequence[TrafficFinding] = ()) -> list[TrafficFinding]:
        """Return all waiting findings, and the given findings, which belong to no frame."""
        for finding in found:
            self._add(finding, None)
        for one in self._waiting:
            one.wanted = 0
        return self._complete()

    def _add(self, finding: TrafficFinding, shown: _Shown | None) -> None:
        if finding.rule not in self._rules or not self._frames:
            self._waiting.append(_Waiting(finding, [], 0))
            return
        around = [*self._before, *([shown] if shown else [])]
        self._waiting.append(_Waiting(finding, around, self._frames))

    def _complete(self) -> list[TrafficFinding]:
        complete = []
        while self._waiting and not self._waiting[0].wanted:
            one = self._waiting.popleft()
            complete.append(one.finding._replace(around=tuple(one.around)))
        return complete


_QUIET_US: Final = 1_000_000
"""Longest wait on a silent bus.

A finding waits this long for the frames after it. A frame counts as overdue only after this time,
because this machine may not have read it yet.
"""


class DecodedCheck:
    """Check of frames by all rules, which decodes the frames first if a rule needs their meaning.

    `canmon check` uses this class. For a rule that the user wrote as an expression, such as
    `181 every 10ms`, each finding also contains the frames around the violation.

    Args:
        rules: rules to check.
        rates: bit rates of the bus, from which the bus load is calculated.
        decoder: decoder of the frames, or None if no rule needs the meaning of frames.
        around: number of frames to show before a violation, and also after it.
        eds_heartbeats: producer heartbeat times (1017h) from EDS files, in ms, by node-ID.
    """

    def __init__(
        self,
        rules: Rules,
        rates: BitRates,
        decoder: Decoder | None,
        around: int,
        eds_heartbeats: EdsHeartbeats = NO_EDS,
    ) -> None:
        self._checker, self._decoder = Checker(rules, *rates, eds_heartbeats), decoder
        self._around = Surroundings(around, (one.name for one in rules.expressions))
        self._latest_us = 0

    def take(self, records: Sequence[Record]) -> list[TrafficFinding]:
        """Check frames. Return the violations."""
        checker, decoder = self._checker, self._decoder
        if decoder is None:
            return [finding for record in records for finding in checker.take(record)]
        found = []
        self._latest_us = records[-1].at_us if records else self._latest_us
        for record in records:
            decoded = decoder.take(record)
            found += self._around.take(record, decoded, checker.take(record, decoded))
        return found

    def wait(self, now_us: int, has_clock: bool) -> list[TrafficFinding]:
        """Return the findings that are due while no frame arrives.

        The method is called repeatedly. After one second without a frame, it returns findings that
        were held back, and findings about overdue frames.

        Args:
            now_us: current time in microseconds on the clock of the source.
            has_clock: whether the frames are stamped by the clock of this machine. This is true for
                a bus. It may be false for a pipe, and overdue frames are then not reported.
        """
        if now_us - self._latest_us <= _QUIET_US:
            return []
        # A pipe may be late by any time: there only frames tell that a deadline has passed.
        return self._around.flush(self._checker.advance(now_us - _QUIET_US) if has_clock else ())

    def end(
        self, end_us: int, lost: Iterable[str], judged_us: int, errors: Iterable[str]
    ) -> list[TrafficFinding]:
        """Return findings about missing frames, as `Checker.end` does."""
        return self._around.flush(self._checker.end(end_us, lost, judged_us, errors))

    def unjudged(self, end_us: int, without_errors: str) -> Unjudged:
        """Return the rules that were not judged, as `Checker.unjudged` does."""
        return self._checker.unjudged(end_us, without_errors)


# Rules checked against live traffic: which are broken now, and which were.


RECENT_US: Final = 2_000_000
"""Time after a violation in which a rule counts as broken."""

GRACE_US: Final = 2_000_000
"""Time after which a frame that has never come counts as missing."""

LATE_US: Final = 1_000_000
"""Time in which a late frame may still be on its way through this machine."""

KEPT: Final = 1_000
"""Number of findings that are kept."""


class AlarmState(StrEnum):
    """The state of a rule on display."""

    HOLDS = "holds"
    BROKEN = "BROKEN"
    WAS_BROKEN = "was broken"  # until it is acknowledged


@dataclass(slots=True)
class Alarm:
    """The alarm of one rule for live traffic: whether the rule is broken, and how often it was.

    Attributes:
        rule: name of the rule.
        count: number of findings. A violation that lasts counts once.
        finding: latest finding of the rule, or None if there was none.
        lasting: whether the rule is broken because a frame is still missing.
        acknowledged: whether the user has acknowledged the latest finding.
    """

    rule: str
    count: int = 0
    finding: TrafficFinding | None = None
    lasting: bool = False
    acknowledged: bool = True

    def state(self, now_us: int) -> AlarmState:
        """Return the state of the rule."""
        if self.finding is None:
            return AlarmState.HOLDS
        if self.lasting or now_us - self.finding.at_us < RECENT_US:
            return AlarmState.BROKEN
        return AlarmState.HOLDS if self.acknowledged else AlarmState.WAS_BROKEN


@dataclass(slots=True)
class Alarms:
    """Live check of rules that keeps for each rule whether it is broken now or was broken before.

    The alarms panel of `canmon tui` shows these alarms, and a recording can be triggered by them.

    Args:
        rules: rules to check.
        bit_rate: bit rate in bits per second, from which the bus load is calculated, or None to use
            the bit rate in `rules`.
        data_bit_rate: bit rate in bits per second in the data phase of CAN FD frames with BRS, or
            None if it equals `bit_rate`.

    Attributes:
        findings: latest findings, from the oldest to the newest.
        judged: whether at least one frame was checked.

    Raises:
        ValueError: the rules limit the bus load, but the bit rate is unknown.
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
        """Start with all rules unbroken."""
        self.clear()

    def clear(self) -> None:
        """Delete all findings, and restart the rules."""
        self._checker = Checker(self.rules, self.bit_rate, self.data_bit_rate)
        self._alarms = {name: Alarm(name) for name in self.rules.names()}
        self.findings = deque(maxlen=KEPT)
        self._begin_us, self.judged = None, False

    def take(self, record: Record, decoded: Decoded | None = None) -> None:
        """Check a frame and its decoded content against the rules."""
        self.judged = True
        for finding in self._checker.take(record, decoded):
            self._found(finding)

    def check_missing(self, now_us: int, lost: int = 0) -> None:
        """Update the alarms for frames that are missing or lost at the current time.

        This method is called repeatedly, because a missing frame cannot trigger a check itself.

        Args:
            now_us: current time in microseconds on the clock of the frames.
            lost: total number of frames that were lost until now.
        """
        if self._begin_us is None:
            self._lost = lost
        # Before the first frame the time is this machine's; the first frame may have an
        # earlier one.
        if self._begin_us is None or now_us < self._begin_us:  # until a frame has a time
            self._begin_us = now_us
        if lost > self._lost and self.rules.no_loss:
            self._found(TrafficFinding(now_us, NO_LOSS, f"{lost - self._lost} frames were lost"))
        self._lost = lost
        for finding in self._checker.advance(now_us - LATE_US):
            self._found(finding)
        missing = self._checker.missing(now_us)
        if now_us - self._begin_us < GRACE_US:  # what has come before may be missed at once
            missing = [one for one in missing if one.rule == NoLostHeartbeat.name]
        self._miss(missing)

    def rows(self) -> list[Alarm]:
        """Return the alarms of all rules in their order."""
        return list(self._alarms.values())

    def broken(self, now_us: int) -> int:
        """Return the number of rules that are broken now."""
        return sum(alarm.state(now_us) is AlarmState.BROKEN for alarm in self._alarms.values())

    def acknowledge(self) -> None:
        """Acknowledge all rules that were broken."""
        for alarm in self._alarms.values():
            alarm.acknowledged = True

    def _miss(self, missing: list[TrafficFinding]) -> None:
        """Record missing frames. A lasting violation is recorded once."""
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
"""The least and the greatest width of the first column."""

_NO_FRAME: Final = "no frame"
"""Text for the state of a rule that no frame has reached yet."""


def render_alarms(alarms: Alarms, now_us: int) -> list[str]:
    """Return the alarms as lines of text for the alarms panel.

    The lines are a table with one rule in each line, followed by the findings from the latest to
    the oldest.

    Args:
        alarms: alarms to show.
        now_us: current time in microseconds, used for the age of findings.
    """
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
