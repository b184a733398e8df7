"""What a rule is asked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model.frames import (
    ERROR,
    REMOTE,
    DumpLines,
    Record,
    Stamp,
    any_ident,
    decoded_text,
    ident_text,
    ms_text,
    sender_of,
)
from tickrig.host.canmon.model.traffic import WINDOW_US, BusSecond
from tickrig.host.text.values import counted
from tickrig.wire.can import STANDARD_MAX, CanFrame, ErrorFrame, describe_error_frame
from tickrig.wire.canopen import nmt, sdo_frame
from tickrig.wire.canopen.emcy import describe

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded


class TrafficFinding(NamedTuple):
    """A violation of a rule, with place and time.

    Attributes:
        at_us: when it was seen.
        rule: name of the rule.
        text: what is wrong, in words.
        record: the frame that shows it, None if none does.
        around: the frames around that time, decoded, if they were requested.
    """

    at_us: int
    rule: str
    text: str
    record: Record | None = None
    around: tuple[tuple[Record, Decoded], ...] = ()

    def __str__(self) -> str:
        """Write it as `line`, with a line as of `canmon dump` for each frame around it."""
        return self.shown(None)

    @property
    def line(self) -> str:
        """One line, time and frame as candump does.

        >>> TrafficFinding(1_500_000, "nodes", "node 3 was never seen").line
        '(1.500000) nodes: node 3 was never seen'
        """
        seconds, micros = divmod(self.at_us, 1_000_000)
        return self._line(f"({seconds}.{micros:06d})")

    def shown(self, lines: DumpLines | None) -> str:
        """Write it with its frames, and times as these lines have them; None: of the epoch."""
        head = self.line if lines is None else self._line(lines.stamp(self.at_us).strip())
        if not self.around:
            return head
        lines = lines or DumpLines(Stamp.ABSOLUTE)
        shown = [
            ("  >" if record is self.record else "   ") + lines.line(record, decoded_text(decoded))
            for record, decoded in self.around
        ]
        return "\n".join([head, *shown])

    def _line(self, stamp: str) -> str:
        shown = f" [{self.record.channel} {self.record.frame}]" if self.record else ""
        return f"{stamp} {self.rule}: {self.text}{shown}"


NO_GAP_US: Final = -1
"""Where a gap is compared: the first frame of an identifier has none."""


class FrameSelection(NamedTuple):
    """Frames of an identifier that a rule must see; other frames do not change its findings.

    If no attribute is given, the rule must see all frames.

    Attributes:
        below_us: frames after a shorter gap.
        above_us: frames after a longer gap.
        first_bytes: frames that begin with one of these.
        firsts: whether to include the first frame of an identifier on a bus.
    """

    below_us: int | None = None
    above_us: int | None = None
    first_bytes: frozenset[int] = frozenset()
    firsts: bool = False


class Seen(NamedTuple):
    """The frames of an identifier on a bus.

    Attributes:
        first_us: time of the first frame.
        last_us: time of the last frame.
        frames: number of frames.
    """

    first_us: int
    last_us: int
    frames: int

    @property
    def has_gaps(self) -> bool:
        """Whether time passed from one to another."""
        return self.frames > 1 and self.first_us != self.last_us


class CheckedTraffic(NamedTuple):
    """The traffic that the rules could judge.

    Attributes:
        seen: the frames of each identifier on each bus, in addition the error frames.
        end_us: time when listening ended.
        without_errors: why the source cannot contain error frames; empty if it can.
    """

    seen: Mapping[tuple[str, int], Seen]
    end_us: int
    without_errors: str = ""

    @property
    def untimed(self) -> bool:
        """Whether all frames have one time: it says nothing of gaps."""
        times = {us for one in self.seen.values() for us in (one.first_us, one.last_us)}
        return len(times) == 1 and sum(one.frames for one in self.seen.values()) > 1

    def on(self, ident: int) -> list[Seen]:
        """Return the frames of an identifier, bus by bus."""
        return [one for (_, other), one in self.seen.items() if other == ident]

    @property
    def without_canopen(self) -> str:
        """Return why no frame can be one of CANopen; empty if some can."""
        if any(not ident & ~(REMOTE | STANDARD_MAX) for _, ident in self.seen):
            return ""
        return "no classic frame with an 11-bit CAN-ID came"


ONE_TIME: Final = "all frames have one time"


class Rule:
    """One rule; this base class sees all frames that it wants, and reports nothing at the end.

    Attributes:
        name: name of the rule in findings and reports.
    """

    name = ""

    def wants(self, ident: int, /) -> bool:
        """Return whether frames of an identifier matter; error frames have `ident.ERROR`."""
        raise NotImplementedError

    def selection(self, ident: int, /) -> FrameSelection:
        """Return which frames of a wanted identifier the rule must see."""
        return FrameSelection()

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Return the violation that a frame shows.

        Args:
            record: the frame.
            gap_us: time since the previous one with this identifier on this bus; None for the
                first.
        """
        raise NotImplementedError

    def begin(self, at_us: int, /) -> None:
        """Take the time of the first frame of all, before any is judged."""

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Return why it has judged nothing, so that it does not count as passed.

        A rule judges each frame that it wants. The absence of error frames also counts as judged. A
        rule with its own `end` judges what is missing.

        Args:
            evidence: traffic with at least one frame or error frame.

        Returns:
            The reason; empty if it has judged something.
        """
        by_absence = type(self).end is not Rule.end or self.wants(ERROR)
        if by_absence or any(self.wants(ident) for _, ident in evidence.seen):
            return ""
        return "no frame that it is about came"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Return what it could not judge besides what it has judged."""
        return ()

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Return what is missing at the end of the traffic.

        Args:
            latest_us: times of the last frame of each identifier, on any bus.
            end_us: end of the traffic.
        """
        return ()


# Rules about frames that should come, and when.


class MaxLoad:
    """No second of a bus has a higher load than the limit.

    Args:
        percent: limit of the load, in percent of the bit rate.
        bit_rate: bits per second.

    Attributes:
        name: name of the rule in findings.
    """

    name = "max-load"

    def __init__(self, percent: float, bit_rate: int) -> None:
        self._percent, self._bit_rate = percent, bit_rate

    def judge(self, channel: str, window: BusSecond) -> str | None:
        """Report a second with too high a load."""
        percent = window.bits * 100_000_000 / (self._bit_rate * WINDOW_US)
        if percent <= self._percent:
            return None
        return f"{channel}: load {percent:.1f} %, at most {self._percent:g} % is right"


_BOOT_UP: Final = bytes([nmt.NmtState.INITIALISING])
_ERROR_CONTROL_IDS: Final = range(nmt.ERROR_CONTROL_COB_ID + 1, nmt.ERROR_CONTROL_COB_ID + 0x80)
_ANSWER_IDS: Final = range(sdo_frame.RESPONSE_COB_ID + 1, sdo_frame.RESPONSE_COB_ID + 0x80)
_REQUEST_IDS: Final = range(sdo_frame.REQUEST_COB_ID + 1, sdo_frame.REQUEST_COB_ID + 0x80)


class HeartbeatTimes(NamedTuple):
    """Limits of the time between two heartbeats of a node.

    Attributes:
        node: its node-ID.
        low_us: shortest time since the previous heartbeat.
        high_us: longest time since the previous heartbeat.
    """

    node: int
    low_us: int
    high_us: int


class Heartbeat(Rule):
    """A heartbeat comes in time, the first one after a boot-up whenever it likes.

    Attributes:
        name: as findings have it.
    """

    def __init__(self, times: HeartbeatTimes) -> None:
        self._times, self._ident = times, nmt.ERROR_CONTROL_COB_ID + times.node
        self.name = f"heartbeat {times.node}"
        self._booted_us: dict[str, int] = {}
        self._free: Counter[str] = Counter()

    def wants(self, ident: int, /) -> bool:
        """Take its COB-ID."""
        return ident == self._ident

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect what comes too soon or too late, and boot-ups."""
        _, low_us, high_us = self._times
        return FrameSelection(low_us, high_us, frozenset(_BOOT_UP), firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap, unless the frame or the one before it is a boot-up."""
        booted_us = self._booted_us.get(record.channel)
        behind_boot = gap_us is not None and record.at_us - gap_us == booted_us
        if record.frame.data[:1] == _BOOT_UP:
            self._booted_us[record.channel] = record.at_us
            self._free[record.channel] += 2 - (gap_us is None or behind_boot)
            return None
        if not record.frame.data:
            return f"node {self._times.node}: heartbeat of 0 B, 1 is right"
        if gap_us is None or behind_boot:
            return None
        if gap_us > self._times.high_us:
            return self._said(gap_us, "at most", self._times.high_us)
        if gap_us < self._times.low_us:
            return self._said(gap_us, "at least", self._times.low_us)
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Report that it stopped or never came."""
        if self._ident not in latest_us:
            yield f"no heartbeat of node {self._times.node} came"
        elif end_us - latest_us[self._ident] > self._times.high_us:
            yield self._said(end_us - latest_us[self._ident], "at most", self._times.high_us)

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that there was no gap to compare: those around boot-ups do not count."""
        if evidence.untimed:
            return ONE_TIME
        gaps = 0
        for (channel, ident), seen in evidence.seen.items():
            if ident == self._ident and seen.has_gaps:
                ends_free = self._booted_us.get(channel) == seen.last_us
                gaps += seen.frames - 1 - self._free[channel] + ends_free
        came = sum(seen.frames for seen in evidence.on(self._ident))
        return "" if gaps > 0 else f"{counted(came, 'frame')} of error control came, and no gap"

    def _said(self, gap_us: int, bound: str, limit_us: int) -> str:
        node, said = self._times.node, f"{bound} {ms_text(limit_us)} is right"
        return f"node {node}: {ms_text(gap_us)} ms since its last heartbeat, {said}"


_GUARD_TOGGLE: Final = 0x80
_NODE_MASK: Final = 0x7F
_LOST_AFTER: Final = 1.5
"""A heartbeat is lost after this many of its periods, as on the node board."""
_SURE_GAPS: Final = 2
"""So many gaps tell a period, where a heartbeat comes after all; silence wants one."""


class _Watched:
    """State of `NoLostHeartbeat` for a node on a bus.

    Args:
        channel: the bus.
        node: its node-ID.
        period_ms: value of 1017h in its EDS; 0 if there is no such value.

    Attributes:
        has_sent: whether it has sent a frame of error control.
        guarded: whether node guarding monitors it: it then sends no heartbeats.
        requested: whether a guarding request has no answer yet.
        judged: whether a gap was compared with a known period.
    """

    def __init__(self, channel: str, node: int, period_ms: int) -> None:
        from tickrig.host.canmon.model.decode.node_memory import (  # noqa: PLC0415 - seldom wanted
            HEARTBEAT_TIME,
            EdsObjects,
            Heartbeats,
            NodeMemory,
        )
        from tickrig.host.canmon.model.decode.sdo import SdoChannel  # noqa: PLC0415

        values = {HEARTBEAT_TIME: period_ms.to_bytes(2, "little")} if period_ms else {}
        self._name, self._memory = f"{channel} node {node}", NodeMemory(EdsObjects(values=values))
        self._heartbeats, self._sdo = Heartbeats(self._memory, from_boot=False), SdoChannel(node)
        self._heartbeat_time, self._eds_us = HEARTBEAT_TIME, period_ms * 1_000
        self._doubted: str | None = None  # lost by the EDS alone, if the next gap agrees with it
        self.has_sent = self.guarded = self.requested = self.judged = False

    def take_sdo(self, at_us: int, data: bytes, *, request: bool) -> None:
        """Learn what SDO traffic says of its objects."""
        step = (self._sdo.request if request else self._sdo.response)(at_us, data)
        for transfer in step.ended:
            if self._memory.learn(transfer) and transfer.entry == self._heartbeat_time:
                self._heartbeats.learn(at_us, transfer)

    def hear(self, at_us: int, data: bytes) -> str | None:
        """Take a frame of error control; say that a heartbeat is lost before it."""
        self.has_sent = True
        if data[:1] == _BOOT_UP:
            self._memory.boot()
            self._heartbeats.boot(at_us)
            self.guarded = self.requested = False
            self._doubted = None
            return None
        self.guarded |= bool(data and data[0] & _GUARD_TOGGLE)
        said = self._lost_before(at_us)
        self._heartbeats.take(at_us, learns=not self.requested)
        self.requested = False
        return said

    def _lost_before(self, at_us: int) -> str | None:
        """Report the heartbeats lost before this one: traffic takes precedence over an EDS."""
        beats = self._heartbeats
        said = self.overdue(at_us)
        if beats.by_sdo or len(beats.gaps) >= _SURE_GAPS:
            return said
        if not beats.gaps:
            doubted, self._doubted = self._doubted, said
        else:
            doubted, self._doubted = self._doubted, None
        keeps_eds = beats.since_us is not None and at_us - beats.since_us <= (
            _LOST_AFTER * self._eds_us
        )
        return doubted if keeps_eds else None

    def overdue(self, at_us: int) -> str | None:
        """Report that its heartbeat is lost at a time."""
        beats = self._heartbeats
        period_us = None if self.guarded else beats.period_us
        if period_us is None or beats.since_us is None:
            return None
        since_us = at_us - beats.since_us
        self.judged |= since_us >= period_us
        if not beats.is_late(at_us):
            return None
        learnt = beats.gaps and not beats.by_sdo
        period = f"{ms_text(period_us)} ms"
        says = f"one each {period} before" if learnt else f"its 1017h says {period}"
        return f"{self._name}: no heartbeat for {ms_text(since_us)} ms, {says}"

    @property
    def watched(self) -> bool:
        """Whether it sent a heartbeat, or SDO traffic contains its period."""
        return self.has_sent or self._heartbeats.by_sdo

    @property
    def doubt(self) -> str:
        """Why nothing was judged of it."""
        if self.guarded:
            return f"{self._name} is guarded"
        if self._heartbeats.period_us is None:
            return f"of {self._name} no period is known"
        return f"of {self._name} no period has passed"


class NoLostHeartbeat(Rule):
    """No heartbeat of a node that sends one is lost.

    The period is the value of 1017h in SDO traffic, or else the measured period, or else the value
    in an EDS. The node board uses the same order. A boot-up restarts the supervision. Answers to
    guarding requests are not heartbeats, because they have a toggle bit.

    Args:
        periods_ms: values of 1017h in EDS files, by node-ID. These nodes must be present.
    """

    name = "no-lost-heartbeat"

    def __init__(self, periods_ms: Mapping[int, int]) -> None:
        self._periods_ms = {node: ms for node, ms in periods_ms.items() if ms}
        self._nodes: dict[tuple[str, int], _Watched] = {}
        self._begin_us: int | None = None

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of error control, and those of SDO, which may tell 1017h."""
        is_sdo = ident in _ANSWER_IDS or ident in _REQUEST_IDS
        return is_sdo or ident & ~REMOTE in _ERROR_CONTROL_IDS

    def begin(self, at_us: int, /) -> None:
        """Note when listening began."""
        self._begin_us = at_us

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap with the period."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        node = self._watched(record.channel, frame.can_id & _NODE_MASK)
        if frame.can_id not in _ERROR_CONTROL_IDS:
            node.take_sdo(record.at_us, frame.data, request=frame.can_id in _REQUEST_IDS)
        elif frame.remote:
            node.requested = True
        else:
            return node.hear(record.at_us, frame.data)
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Name the nodes whose heartbeat stopped, and those with an EDS that sent none."""
        for _, node in sorted(self._nodes.items()):
            if (text := node.overdue(end_us)) is not None:
                yield text
        begin_us = end_us if self._begin_us is None else self._begin_us
        for node_id, period_ms in sorted(self._periods_ms.items()):
            if (
                not self._is_watched(node_id)
                and end_us - begin_us > _LOST_AFTER * period_ms * 1_000
            ):
                since = ms_text(end_us - begin_us)
                yield f"node {node_id}: no heartbeat for {since} ms, its EDS says {period_ms} ms"

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that no period was known, or none has passed."""
        if evidence.untimed:
            return ONE_TIME
        doubts = self._doubts()
        if any(node.judged for node in self._nodes.values()):
            return ""
        return "; ".join(doubts) or "no heartbeat came"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Name the nodes of which nothing was judged."""
        return self._doubts()

    def _watched(self, channel: str, node: int) -> _Watched:
        key = channel, node
        if key not in self._nodes:
            self._nodes[key] = _Watched(channel, node, self._periods_ms.get(node, 0))
        return self._nodes[key]

    def _is_watched(self, node: int) -> bool:
        found = (one for (_, other), one in self._nodes.items() if other == node)
        return any(one.watched for one in found)

    def _doubts(self) -> list[str]:
        watched = (node for _, node in sorted(self._nodes.items()))
        return [one.doubt for one in watched if one.has_sent and not one.judged]


class MaxGap(Rule):
    """An identifier comes again in time.

    Attributes:
        name: as findings have it.
    """

    def __init__(self, ident: int, most_us: int) -> None:
        self._ident, self._most_us = ident, most_us
        self.name = f"max-gap {ident_text(ident)}"

    def wants(self, ident: int, /) -> bool:
        """Take its frames."""
        return ident == self._ident

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect what comes too late."""
        return FrameSelection(above_us=self._most_us)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap."""
        return None if gap_us is None or gap_us <= self._most_us else self._said(gap_us)

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Report that it stopped or never came."""
        if self._ident not in latest_us:
            yield f"{ident_text(self._ident)} never came"
        elif end_us - latest_us[self._ident] > self._most_us:
            yield self._said(end_us - latest_us[self._ident])

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that it came once."""
        if evidence.untimed:
            return ONE_TIME
        if any(seen.has_gaps for seen in evidence.on(self._ident)):
            return ""
        return f"{ident_text(self._ident)} came once"

    def _said(self, gap_us: int) -> str:
        limit = f"at most {ms_text(self._most_us)} is right"
        return f"{ms_text(gap_us)} ms without {ident_text(self._ident)}, {limit}"


# Rules about frames that should not be there.


_EMCY_IDS: Final = range(0x081, 0x100)
_CODE_BYTES: Final = 2
_EMCY_BYTES: Final = 8
_NAMED_BYTES: Final = 4
"""An SDO frame of at least this many bytes names its object."""


class CanopenRule(Rule):
    """A rule about frames that should not be there, among those that may be of CANopen."""

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Return why no frame can be one of CANopen."""
        return evidence.without_canopen


class NoEmcy(CanopenRule):
    """No EMCY except error reset, on the default COB-IDs; one that is too short counts too."""

    name = "no-emcy"

    def __init__(self) -> None:
        self._cut = 0

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of EMCY."""
        return ident in _EMCY_IDS

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Name the error."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        data, node = frame.data, frame.can_id & _NODE_MASK
        code = int.from_bytes(data[:_CODE_BYTES], "little")
        if len(data) < _CODE_BYTES:
            self._cut += 1
        if not code or len(data) < _CODE_BYTES:
            return None
        length = "" if len(data) == _EMCY_BYTES else f" ({len(data)} B, {_EMCY_BYTES} are right)"
        return f"node {node}: EMCY {code:04X}h {describe(code)}{length}"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Return how many frames are too short for an error code."""
        if self._cut:
            yield f"{counted(self._cut, 'frame')} of EMCY without a whole error code"


class NoSdoAbort(CanopenRule):
    """No aborted transfer at a default SDO server; an abort that is cut short is one, too."""

    name = "no-sdo-abort"

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of the default servers."""
        return ident in _ANSWER_IDS or ident in _REQUEST_IDS

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect aborts."""
        return FrameSelection(first_bytes=frozenset([sdo_frame.ClientCommand.ABORT]))

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Name object and abort code."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        data = frame.data
        if len(data) < _NAMED_BYTES or data[0] != sdo_frame.ClientCommand.ABORT:
            return None
        index, sub = sdo_frame.index_sub(data)
        which = f"{index:04X}h:{sub:02X}" if index or sub else "its transfer"
        side = "server" if frame.can_id in _ANSWER_IDS else "client"
        reason = sdo_frame.describe_abort(int.from_bytes(data[4:], "little"))
        if len(data) < sdo_frame.FRAME_BYTES:
            reason = (
                f"without a whole abort code ({len(data)} B, {sdo_frame.FRAME_BYTES} are right)"
            )
        node = frame.can_id & _NODE_MASK
        return f"node {node}: {side} aborts {which}, {reason}"


class NoErrorFrames(Rule):
    """No error frame."""

    name = "no-error-frames"

    def wants(self, ident: int, /) -> bool:
        """Take error frames."""
        return ident == ERROR

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Report what failed."""
        frame = record.frame
        assert isinstance(frame, ErrorFrame)
        return describe_error_frame(frame)

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that the source cannot contain error frames."""
        return evidence.without_errors


class KnownIds(Rule):
    """No identifiers except these; each other one is reported once per bus.

    Args:
        idents: see `ident_of`.
    """

    name = "known"

    def __init__(self, idents: frozenset[int]) -> None:
        self._idents = idents

    def wants(self, ident: int, /) -> bool:
        """Take all others."""
        return ident not in self._idents and ident != ERROR

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect the first frame."""
        return FrameSelection(firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Tell the first frame."""
        return None if gap_us is not None else f"{_text(record)} is not expected"

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that there was no identifier."""
        return "" if evidence.seen else "no frame with a CAN-ID came"


def _text(record: Record) -> str:
    assert not isinstance(record.frame, ErrorFrame)
    return ident_text(any_ident(record.frame))


_RESETS: Final = frozenset([nmt.NmtCommand.RESET_NODE, nmt.NmtCommand.RESET_COMMUNICATION])


class NodesPresent(Rule):
    """These nodes are present: each has sent a frame with one of its default COB-IDs."""

    name = "nodes"

    def __init__(self, nodes: Iterable[int]) -> None:
        self._nodes = sorted(nodes)

    def wants(self, ident: int, /) -> bool:
        """Take nothing: what is missing is seen at the end."""
        return False

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Find nothing."""
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Name those that were never seen."""
        present = set(map(sender_of, latest_us))
        for node in self._nodes:
            if node not in present:
                yield f"node {node} was never seen"


class NoReboot(CanopenRule):
    """No node that was seen before boots without an NMT reset.

    Any frame that begins with 0 counts as a boot-up, because some nodes send more than one byte.
    """

    name = "no-reboot"

    def __init__(self) -> None:
        self._commanded: set[int] = set()
        self._present: set[tuple[str, int]] = set()

    def wants(self, ident: int, /) -> bool:
        """Take NMT commands and what nodes send."""
        return ident == nmt.NMT_COB_ID or sender_of(ident) is not None

    def selection(self, ident: int, /) -> FrameSelection:
        """Process resets and boot-ups; the first other frame marks its node as seen."""
        if ident == nmt.NMT_COB_ID:
            return FrameSelection(first_bytes=_RESETS)
        boot_up = frozenset(_BOOT_UP) if ident in _ERROR_CONTROL_IDS else frozenset()
        return FrameSelection(first_bytes=boot_up, firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Note a reset; say that a boot-up comes without one."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        node = sender_of(frame.can_id)
        if node is None:
            if len(frame.data) == 2 and frame.data[0] in _RESETS:
                self._expect_reset(frame.data[1])
            return None
        is_new = (record.channel, node) not in self._present
        self._present.add((record.channel, node))
        if frame.can_id not in _ERROR_CONTROL_IDS or frame.data[:1] != _BOOT_UP:
            return None
        expected = is_new or node in self._commanded
        self._commanded.discard(node)
        return None if expected else f"node {node} boots again without an NMT reset"

    def _expect_reset(self, node: int) -> None:
        self._commanded |= set(range(1, 0x80)) if node == nmt.ALL_NODES else {node}
