"""Rules for frames, and the interface through which rules are used."""

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
    ident_text,
    ms_text,
    sender_of,
)
from tickrig.host.canmon.model.traffic import LEAST_WINDOW_US, BusSecond
from tickrig.host.text.values import counted
from tickrig.wire.can import STANDARD_MAX, CanFrame, ErrorFrame, describe_error_frame
from tickrig.wire.canopen import nmt, sdo_frame
from tickrig.wire.canopen.emcy import describe

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded


class TrafficFinding(NamedTuple):
    """A violation of a rule by the traffic, which a check reports to the user.

    Attributes:
        at_us: time in microseconds at which the violation was detected.
        rule: name of the violated rule.
        text: description of the violation.
        record: frame that shows the violation, or None if it is not in a single frame, as for a
            missing frame.
        around: frames before and after the violation with their meanings, empty if they were not
            requested.
    """

    at_us: int
    rule: str
    text: str
    record: Record | None = None
    around: tuple[tuple[Record, Decoded], ...] = ()

    def __str__(self) -> str:
        """Return `line`, and a line as in `canmon dump` for each frame around the violation."""
        return self.shown(None)

    @property
    def line(self) -> str:
        """Return the finding as one line, with time and frame in candump notation.

        >>> TrafficFinding(1_500_000, "nodes", "node 3 was never seen").line
        '(1.500000) nodes: node 3 was never seen'
        """
        seconds, micros = divmod(self.at_us, 1_000_000)
        return self._line(f"({seconds}.{micros:06d})")

    def shown(self, lines: DumpLines | None) -> str:
        """Return the finding as text: one line, and more lines for the frames around the violation.

        Args:
            lines: formatter for the frames, which also sets the format of times. If it is None,
                times are written in seconds since the epoch.
        """
        head = self.line if lines is None else self._line(lines.stamp(self.at_us).strip())
        if not self.around:
            return head
        lines = lines or DumpLines(Stamp.ABSOLUTE)
        return "\n".join([head, *lines.around(self.around, self.record)])

    def _line(self, stamp: str) -> str:
        shown = f" [{self.record.channel} {self.record.frame}]" if self.record else ""
        return f"{stamp} {self.rule}: {self.text}{shown}"


NO_GAP_US: Final = -1
"""Gap before the first frame of an identifier, where gaps are compared."""


class FrameSelection(NamedTuple):
    """Selection of the frames of a CAN-ID that a rule must see to find every violation.

    A check in blocks of frames skips all other frames to save time. If no attribute is given, all
    frames of the CAN-ID are selected. A gap is the time since the previous frame of the CAN-ID.

    Attributes:
        below_us: frames after a gap shorter than this time in microseconds are selected, or None
            for no such frames.
        above_us: frames after a gap longer than this time in microseconds are selected, or None for
            no such frames.
        first_bytes: frames whose first data byte has one of these values are selected.
        firsts: whether the first frame of the CAN-ID on each bus is selected.
    """

    below_us: int | None = None
    above_us: int | None = None
    first_bytes: frozenset[int] = frozenset()
    firsts: bool = False


class Seen(NamedTuple):
    """Number of frames of one CAN-ID on one bus, with the times of the first and the last frame.

    Attributes:
        first_us: time of the first frame in microseconds.
        last_us: time of the last frame in microseconds.
        frames: number of frames.
    """

    first_us: int
    last_us: int
    frames: int

    @property
    def has_gaps(self) -> bool:
        """Whether the identifier has frames at different times."""
        return self.frames > 1 and self.first_us != self.last_us


class CheckedTraffic(NamedTuple):
    """Summary of the checked traffic.

    A rule without a finding has either passed, or the traffic contained nothing to judge. At the
    end of a check, each rule uses this summary to find out which of the two is the case.

    Attributes:
        seen: number and times of the frames, by name of the bus and CAN-ID with flags. Error frames
            are included.
        end_us: time in microseconds at which listening ended.
        without_errors: reason why the source cannot contain error frames, empty if it can.
    """

    seen: Mapping[tuple[str, int], Seen]
    end_us: int
    without_errors: str = ""

    @property
    def untimed(self) -> bool:
        """Whether all frames have the same time, so that gaps are unknown."""
        times = {us for one in self.seen.values() for us in (one.first_us, one.last_us)}
        return len(times) == 1 and sum(one.frames for one in self.seen.values()) > 1

    @property
    def is_short(self) -> bool:
        """Whether the traffic is shorter than `LEAST_WINDOW_US`.

        The load of such short traffic is calculated for a full second, because the traffic may be a
        single burst of frames.
        """
        first_us = min((one.first_us for one in self.seen.values()), default=self.end_us)
        return self.end_us - first_us < LEAST_WINDOW_US

    def on(self, ident: int) -> list[Seen]:
        """Return the frames of an identifier on each bus."""
        return [one for (_, other), one in self.seen.items() if other == ident]

    @property
    def without_canopen(self) -> str:
        """Return why no frame can be a CANopen frame, empty if some frames can."""
        if any(not ident & ~(REMOTE | STANDARD_MAX) for _, ident in self.seen):
            return ""
        return "no classic frame with an 11-bit CAN-ID came"


ONE_TIME: Final = "all frames have one time"


class Rule:
    """Base class of the rules that a check applies to each frame, such as `NoEmcy` or `MaxGap`.

    By default, a rule judges all frames of the CAN-IDs that it wants, and reports nothing at the
    end of the traffic.

    Attributes:
        name: name of the rule in findings and reports, such as `no-emcy`.
    """

    name = ""

    def wants(self, ident: int, /) -> bool:
        """Return whether the rule must see the frames of a CAN-ID.

        Args:
            ident: CAN-ID with flags. For error frames, it contains the flag `ident.ERROR`.
        """
        raise NotImplementedError

    def selection(self, ident: int, /) -> FrameSelection:
        """Return which frames of a wanted identifier the rule must see."""
        return FrameSelection()

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Return a description of the violation in a frame, or None if the frame violates nothing.

        Args:
            record: frame to judge. The method `wants` returned True for its CAN-ID.
            gap_us: time in microseconds since the previous frame of this CAN-ID on this bus, or
                None for the first frame.
        """
        raise NotImplementedError

    def begin(self, at_us: int, /) -> None:
        """Record the time of the first frame of all, before any frame is judged."""

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Return the reason why the rule has judged nothing, so that it does not count as passed.

        By default, a rule has judged something if a frame has arrived for which `wants` returns
        True. Two kinds of rules always judge something, because they also judge that frames are
        absent: rules about error frames, and rules whose class overrides `end`.

        Args:
            evidence: summary of the traffic, which has at least one frame or error frame.

        Returns:
            The reason, or an empty text if the rule has judged something.
        """
        by_absence = type(self).end is not Rule.end or self.wants(ERROR)
        if by_absence or any(self.wants(ident) for _, ident in evidence.seen):
            return ""
        return "no frame that it is about came"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Return what the rule could not judge, in addition to its findings."""
        return ()

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Return a description of each violation that is known only at the end of the traffic.

        An example is a heartbeat that has stopped.

        Args:
            latest_us: time of the last frame of each CAN-ID in microseconds, by CAN-ID. All buses
                are taken together.
            end_us: end of the traffic in microseconds.
        """
        return ()


# Rules about frames that should come, and when.


class MaxLoad:
    """Rule that limits the bus load in each second.

    Args:
        percent: largest allowed bus load, in percent of the bit rate.
        bit_rate: bit rate in bits per second.

    Attributes:
        name: name of the rule in findings and reports.
    """

    name = "max-load"

    def __init__(self, percent: float, bit_rate: int) -> None:
        self._percent, self._bit_rate = percent, bit_rate

    def judge(self, channel: str, window: BusSecond) -> str | None:
        """Report a second whose load is too high."""
        percent = window.bits * 100_000_000 / (self._bit_rate * window.span_us)
        if percent <= self._percent:
            return None
        return f"{channel}: load {percent:.1f} %, at most {self._percent:g} % is right"


_BOOT_UP: Final = bytes([nmt.NmtState.INITIALISING])
_ERROR_CONTROL_IDS: Final = range(nmt.ERROR_CONTROL_COB_ID + 1, nmt.ERROR_CONTROL_COB_ID + 0x80)
_ANSWER_IDS: Final = range(sdo_frame.RESPONSE_COB_ID + 1, sdo_frame.RESPONSE_COB_ID + 0x80)
_REQUEST_IDS: Final = range(sdo_frame.REQUEST_COB_ID + 1, sdo_frame.REQUEST_COB_ID + 0x80)


class _Resets:
    """NMT resets of nodes that have not booted since. A reset explains why a node is silent."""

    def __init__(self) -> None:
        self._at_us: dict[tuple[str, int], int] = {}

    def take(self, record: Record) -> None:
        """Process an NMT command."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        if len(frame.data) != 2 or frame.data[0] not in nmt.RESETS:
            return
        target = frame.data[1]
        for node in range(1, 0x80) if target == nmt.ALL_NODES else (target,):
            self._at_us.setdefault((record.channel, node), record.at_us)

    def ended(self, record: Record, node: int) -> int | None:
        """Return the time of the NMT reset before a boot-up, or None if there was no reset."""
        return self._at_us.pop((record.channel, node), None)


class HeartbeatTimes(NamedTuple):
    """Limits of the time between two successive heartbeats of one node, for the rule `Heartbeat`.

    Attributes:
        node: node-ID of the node that sends the heartbeats.
        low_us: shortest allowed time between two heartbeats in microseconds.
        high_us: longest allowed time between two heartbeats in microseconds.
    """

    node: int
    low_us: int
    high_us: int


class Heartbeat(Rule):
    """Rule that the heartbeats of one node arrive neither too early nor too late.

    The first heartbeat after a boot-up may arrive at any time. If a node stops its heartbeats and
    boots, the time from its last heartbeat to the boot-up is compared with the upper limit only. If
    an NMT command has reset the node, the time from the last heartbeat to this command is compared
    instead.

    Args:
        times: node-ID, and limits of the time between two heartbeats.

    Attributes:
        name: name of the rule in findings and reports, such as `heartbeat 3`.
    """

    def __init__(self, times: HeartbeatTimes) -> None:
        self._times, self._ident = times, nmt.ERROR_CONTROL_COB_ID + times.node
        self.name = f"heartbeat {times.node}"
        self._booted_us: dict[str, int] = {}
        self._free: Counter[str] = Counter()
        self._resets = _Resets()

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is that of the heartbeat, or of NMT commands."""
        return ident in (self._ident, nmt.NMT_COB_ID)

    def selection(self, ident: int, /) -> FrameSelection:
        """Select frames that arrive too early or too late, boot-ups, and resets."""
        if ident == nmt.NMT_COB_ID:
            return FrameSelection(first_bytes=nmt.RESETS)
        _, low_us, high_us = self._times
        return FrameSelection(low_us, high_us, frozenset(_BOOT_UP), firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap, unless the previous frame is a boot-up."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        if frame.can_id == nmt.NMT_COB_ID:
            self._resets.take(record)
            return None
        booted_us = self._booted_us.get(record.channel)
        behind_boot = gap_us is not None and record.at_us - gap_us == booted_us
        if frame.data[:1] == _BOOT_UP:
            return self._boot(record, None if behind_boot else gap_us)
        if not frame.data:
            return f"node {self._times.node}: heartbeat of 0 B, 1 is right"
        if gap_us is None or behind_boot:
            return None
        if gap_us < self._times.low_us:
            return self._said(gap_us, "at least", self._times.low_us)
        return self._late(gap_us)

    def _boot(self, record: Record, gap_us: int | None) -> str | None:
        """Compare the gap before a boot-up, which is None if it does not count."""
        reset_us = self._resets.ended(record, self._times.node)
        self._booted_us[record.channel] = record.at_us
        self._free[record.channel] += 1 + (gap_us is not None and reset_us is not None)
        if gap_us is None:
            return None
        if reset_us is not None:
            gap_us -= record.at_us - reset_us
        return self._late(gap_us)

    def _late(self, gap_us: int) -> str | None:
        high_us = self._times.high_us
        return self._said(gap_us, "at most", high_us) if gap_us > high_us else None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Report that the heartbeat stopped or never arrived."""
        if self._ident not in latest_us:
            yield f"no heartbeat of node {self._times.node} came"
        elif (text := self._late(end_us - latest_us[self._ident])) is not None:
            yield text

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Return the reason why nothing was judged, if there was no gap to compare.

        If there was a gap, the result is an empty text. A gap is the time between two successive
        heartbeats, or from a heartbeat to a boot-up without an NMT reset.
        """
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
"""Number of periods after which a heartbeat is lost, as on the node board."""
_SURE_GAPS: Final = 2
"""Number of gaps from which a period is known if a heartbeat arrives late.

Silence needs one gap.
"""


class _Watched:
    """State of `NoLostHeartbeat` for a node on a bus.

    Args:
        channel: the bus.
        node: node-ID of the node.
        period_ms: value of 1017h in the EDS of the node, or 0 if there is no such value.

    Attributes:
        has_sent: whether the node has sent a frame of error control.
        guarded: whether node guarding monitors the node, so that the node sends no heartbeats.
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

    def take_sdo(self, at_us: int, data: bytes, *, request: bool) -> str | None:
        """Store values of the node's objects that SDO traffic contains.

        A write to 1017h restarts the supervision of the heartbeat. If a heartbeat was lost before
        the write, the result is a description of this violation, otherwise None.
        """
        step = (self._sdo.request if request else self._sdo.response)(at_us, data)
        said = None
        for transfer in step.ended:
            is_beat = transfer.entry == self._heartbeat_time
            late = self._surely_overdue(at_us) if is_beat else None
            if self._memory.learn(transfer) and is_beat:
                self._heartbeats.learn(at_us, transfer)
                said = said or (late if self._heartbeats.since_us == at_us else None)
        return said

    def boot(self, at_us: int, reset_us: int | None) -> str | None:
        """Process a boot-up of the node.

        The method checks whether the heartbeat was overdue at the reset, or at the boot-up if there
        was no reset. If it was overdue, the result is a description of this violation, otherwise
        None.

        Args:
            at_us: time of the boot-up in microseconds.
            reset_us: time of the NMT reset before the boot-up in microseconds, or None if there was
                no reset.
        """
        said = self._surely_overdue(at_us if reset_us is None else reset_us)
        self._memory.boot()
        self._heartbeats.boot(at_us)
        self.has_sent = True
        self.guarded = self.requested = False
        self._doubted = None
        return said

    def hear(self, at_us: int, data: bytes) -> str | None:
        """Process an error control frame of the node, except a boot-up.

        The result is a description of the violation if a heartbeat before this frame was lost,
        otherwise None.

        Args:
            at_us: time of the frame in microseconds.
            data: data bytes of the frame.
        """
        self.has_sent = True
        self.guarded |= bool(data and data[0] & _GUARD_TOGGLE)
        said = self._lost_before(at_us)
        self._heartbeats.take(at_us, learns=not self.requested)
        self.requested = False
        return said

    def _lost_before(self, at_us: int) -> str | None:
        """Report the heartbeats that are lost before this one.

        Traffic takes precedence over an EDS.
        """
        beats = self._heartbeats
        said = self.overdue(at_us)
        if beats.by_sdo or len(beats.gaps) >= _SURE_GAPS:
            return said
        doubted, self._doubted = self._doubted, None if beats.gaps else said
        keeps_eds = beats.since_us is not None and at_us - beats.since_us <= (
            _LOST_AFTER * self._eds_us
        )
        return doubted if keeps_eds else None

    def _surely_overdue(self, at_us: int) -> str | None:
        """Return a finding as `overdue` does, unless only an EDS gives the period, or one gap."""
        beats = self._heartbeats
        return self.overdue(at_us) if beats.by_sdo or len(beats.gaps) >= _SURE_GAPS else None

    def overdue(self, at_us: int) -> str | None:
        """Return a finding if the heartbeat of the node is lost at this time."""
        beats = self._heartbeats
        period_us = None if self.guarded else beats.period_us
        if period_us is None or beats.since_us is None:
            return None
        since_us = at_us - beats.since_us
        self.judged |= since_us >= period_us
        if not beats.is_late(at_us):
            return None
        period = f"{ms_text(period_us)} ms"
        says = f"one each {period} before" if beats.learnt else f"its 1017h says {period}"
        return f"{self._name}: no heartbeat for {ms_text(since_us)} ms, {says}"

    @property
    def watched(self) -> bool:
        """Whether the node sent a heartbeat, or SDO traffic contains the heartbeat period."""
        return self.has_sent or self._heartbeats.by_sdo

    @property
    def doubt(self) -> str:
        """Reason why no heartbeat of the node was judged."""
        if self.guarded:
            return f"{self._name} is guarded"
        if self._heartbeats.period_us is None:
            return f"of {self._name} no period is known"
        return f"of {self._name} no period has passed"


class NoLostHeartbeat(Rule):
    """Rule that a node which sends heartbeats does not omit any.

    The expected period comes from 1017h in SDO traffic. If 1017h was not transferred, the measured
    period is used, or otherwise the value from an EDS file. From an NMT command that resets the
    node to the boot-up of the node, no heartbeats are expected. If a node boots without such a
    command, heartbeats are expected until the boot-up. The supervision starts again at each
    boot-up.

    Answers to node guarding requests, which have a toggle bit, do not count as heartbeats.

    Args:
        periods_ms: producer heartbeat times (1017h) from EDS files, in ms, by node-ID. A node with
            such a time must send heartbeats.
    """

    name = "no-lost-heartbeat"

    def __init__(self, periods_ms: Mapping[int, int]) -> None:
        self._periods_ms = {node: ms for node, ms in periods_ms.items() if ms}
        self._nodes: dict[tuple[str, int], _Watched] = {}
        self._resets = _Resets()
        self._begin_us: int | None = None

    def wants(self, ident: int, /) -> bool:
        """Return whether the rule must see the frames of a CAN-ID.

        The rule must see error control frames, SDO frames and NMT commands. An SDO transfer may
        contain 1017h. NMT commands may reset nodes.

        Args:
            ident: CAN-ID with flags.
        """
        is_sdo = ident in _ANSWER_IDS or ident in _REQUEST_IDS
        return is_sdo or ident & ~REMOTE in _ERROR_CONTROL_IDS or ident == nmt.NMT_COB_ID

    def selection(self, ident: int, /) -> FrameSelection:
        """Select all frames of nodes, and resets."""
        return FrameSelection(first_bytes=nmt.RESETS if ident == nmt.NMT_COB_ID else frozenset())

    def begin(self, at_us: int, /) -> None:
        """Record the start of listening."""
        self._begin_us = at_us

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap with the period."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        if frame.can_id == nmt.NMT_COB_ID:
            self._resets.take(record)
            return None
        node_id = frame.can_id & _NODE_MASK
        node = self._watched(record.channel, node_id)
        if frame.can_id not in _ERROR_CONTROL_IDS:
            is_request = frame.can_id in _REQUEST_IDS
            return node.take_sdo(record.at_us, frame.data, request=is_request)
        if frame.remote:
            node.requested = True
        elif frame.data[:1] == _BOOT_UP:
            return node.boot(record.at_us, self._resets.ended(record, node_id))
        else:
            return node.hear(record.at_us, frame.data)
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Report nodes whose heartbeat stopped, and nodes with an EDS that sent no heartbeat."""
        for _, node in sorted(self._nodes.items()):
            if (text := node.overdue(end_us)) is not None:
                yield text
        since_us = 0 if self._begin_us is None else end_us - self._begin_us
        for node_id, period_ms in sorted(self._periods_ms.items()):
            if not self._is_watched(node_id) and since_us > _LOST_AFTER * period_ms * 1_000:
                since = ms_text(since_us)
                yield f"node {node_id}: no heartbeat for {since} ms, its EDS says {period_ms} ms"

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that no period was known, or that no period has passed."""
        if evidence.untimed:
            return ONE_TIME
        doubts = self._doubts()
        if any(node.judged for node in self._nodes.values()):
            return ""
        return "; ".join(doubts) or "no heartbeat came"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Report the nodes that were not judged."""
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
    """Rule that limits the time between two successive frames of a CAN-ID.

    Args:
        ident: CAN-ID with flags.
        most_us: longest allowed time between two frames in microseconds.

    Attributes:
        name: name of the rule in findings and reports, such as `max-gap 181`.
    """

    def __init__(self, ident: int, most_us: int) -> None:
        self._ident, self._most_us = ident, most_us
        self.name = f"max-gap {ident_text(ident)}"

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is that of the rule."""
        return ident == self._ident

    def selection(self, ident: int, /) -> FrameSelection:
        """Select frames that arrive too late."""
        return FrameSelection(above_us=self._most_us)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap before the frame."""
        return None if gap_us is None or gap_us <= self._most_us else self._said(gap_us)

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Report that the frames stopped or never arrived."""
        if self._ident not in latest_us:
            yield f"{ident_text(self._ident)} never came"
        elif end_us - latest_us[self._ident] > self._most_us:
            yield self._said(end_us - latest_us[self._ident])

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that the identifier had only one frame."""
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


class _CanopenRule(Rule):
    """Rule against frames that should not occur, among frames that may be CANopen frames."""

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Return why no frame can be a CANopen frame."""
        return evidence.without_canopen


class NoEmcy(_CanopenRule):
    """Rule that no node sends an EMCY message, except to report that an error is gone (code 0000h).

    Only the default COB-IDs of EMCY messages are judged. An EMCY message with fewer than 8 bytes is
    also a violation if it contains the error code.
    """

    name = "no-emcy"

    def __init__(self) -> None:
        self._cut = 0

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is a COB-ID of EMCY."""
        return ident in _EMCY_IDS

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Report the error code."""
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


class NoSdoAbort(_CanopenRule):
    """Rule that no SDO transfer at a default SDO server is aborted, by the client or the server.

    An abort frame that is too short for an abort code is also a violation.
    """

    name = "no-sdo-abort"

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is a COB-ID of a default SDO server."""
        return ident in _ANSWER_IDS or ident in _REQUEST_IDS

    def selection(self, ident: int, /) -> FrameSelection:
        """Select SDO aborts."""
        return FrameSelection(first_bytes=frozenset([sdo_frame.ClientCommand.ABORT]))

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Report object and abort code."""
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
            right = f"{len(data)} B, {sdo_frame.FRAME_BYTES} are right"
            reason = f"without a whole abort code ({right})"
        node = frame.can_id & _NODE_MASK
        return f"node {node}: {side} aborts {which}, {reason}"


class NoErrorFrames(Rule):
    """Rule against error frames."""

    name = "no-error-frames"

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is that of error frames."""
        return ident == ERROR

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Report the class of the error."""
        frame = record.frame
        assert isinstance(frame, ErrorFrame)
        return describe_error_frame(frame)

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that the source cannot contain error frames."""
        return evidence.without_errors


class KnownIds(Rule):
    """Rule that no CAN-IDs occur except the given ones.

    Any other CAN-ID is reported once on each bus.

    Args:
        idents: allowed CAN-IDs with flags, as `ident_of` returns them.
    """

    name = "known"

    def __init__(self, idents: frozenset[int]) -> None:
        self._idents = idents

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is not allowed."""
        return ident not in self._idents and ident != ERROR

    def selection(self, ident: int, /) -> FrameSelection:
        """Select the first frame of an identifier."""
        return FrameSelection(firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Report the first frame of an identifier."""
        return None if gap_us is not None else f"{_text(record)} is not expected"

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Report that there was no identifier."""
        return "" if evidence.seen else "no frame with a CAN-ID came"


def _text(record: Record) -> str:
    assert not isinstance(record.frame, ErrorFrame)
    return ident_text(any_ident(record.frame))


class NodesPresent(Rule):
    """Rule that all given nodes are present. Missing nodes are reported at the end of the traffic.

    A node is present if it has sent at least one frame with one of its default COB-IDs.

    Args:
        nodes: node-IDs of the nodes that must be present.
    """

    name = "nodes"

    def __init__(self, nodes: Iterable[int]) -> None:
        self._nodes = sorted(nodes)

    def wants(self, ident: int, /) -> bool:
        """Return False. Missing nodes are found at the end."""
        return False

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Return no finding."""
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Report the nodes that sent no frame."""
        present = set(map(sender_of, latest_us))
        for node in self._nodes:
            if node not in present:
                yield f"node {node} was never seen"


class NoReboot(_CanopenRule):
    """Rule that no node boots again unless an NMT command has reset it.

    The boot-up of a node that has not sent a frame before is allowed. Any error control frame whose
    first byte is 0 counts as a boot-up, because some nodes send more than one byte.
    """

    name = "no-reboot"

    def __init__(self) -> None:
        self._commanded: set[int] = set()
        self._present: set[tuple[str, int]] = set()

    def wants(self, ident: int, /) -> bool:
        """Return whether the identifier is that of NMT commands, or belongs to a node."""
        return ident == nmt.NMT_COB_ID or sender_of(ident) is not None

    def selection(self, ident: int, /) -> FrameSelection:
        """Select resets and boot-ups. The first other frame marks a node as active."""
        if ident == nmt.NMT_COB_ID:
            return FrameSelection(first_bytes=nmt.RESETS)
        boot_up = frozenset(_BOOT_UP) if ident in _ERROR_CONTROL_IDS else frozenset()
        return FrameSelection(first_bytes=boot_up, firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Record a reset. Report a boot-up without a reset."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        node = sender_of(frame.can_id)
        if node is None:
            if len(frame.data) == 2 and frame.data[0] in nmt.RESETS:
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
