"""Rules about frames that should come, and when."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from tickrig.host.monitor.check.rule import FrameSelection, Rule
from tickrig.host.monitor.frames.ident import ident_text
from tickrig.host.monitor.frames.quantity import ms_text
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.traffic.traffic import WINDOW_US, Window
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState


class MaxLoad:
    """No second of a bus is busier.

    Args:
        percent: of the bit rate.
        bit_rate: bits a second.

    Attributes:
        name: as findings have it.
    """

    name = "max-load"

    def __init__(self, percent: float, bit_rate: int) -> None:
        self._percent, self._bit_rate = percent, bit_rate

    def judge(self, channel: str, window: Window) -> str | None:
        """Say that a second is too busy."""
        percent = window.bits * 100_000_000 / (self._bit_rate * WINDOW_US)
        if percent <= self._percent:
            return None
        return f"{channel}: load {percent:.1f} %, at most {self._percent:g} % is right"


BOOT_UP: Final = bytes([NmtState.INITIALISING])
ERROR_CONTROL_IDS: Final = range(ERROR_CONTROL_COB_ID + 1, ERROR_CONTROL_COB_ID + 0x80)


class HeartbeatTimes(NamedTuple):
    """When the heartbeat of a node must come.

    Attributes:
        node: its node-ID.
        low_us: it comes no sooner after the one before.
        high_us: and no later.
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
        self._times, self._ident = times, ERROR_CONTROL_COB_ID + times.node
        self.name = f"heartbeat {times.node}"
        self._booted_us: dict[str, int] = {}

    def wants(self, ident: int, /) -> bool:
        """Take its COB-ID."""
        return ident == self._ident

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect what comes too soon or too late, and boot-ups."""
        _, low_us, high_us = self._times
        return FrameSelection(low_us, high_us, frozenset(BOOT_UP), firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap, unless the frame or the one before it is a boot-up."""
        if record.frame.data == BOOT_UP:
            self._booted_us[record.channel] = record.at_us
            return None
        if gap_us is None or record.at_us - gap_us == self._booted_us.get(record.channel):
            return None
        if gap_us > self._times.high_us:
            return self._said(gap_us, "at most", self._times.high_us)
        if gap_us < self._times.low_us:
            return self._said(gap_us, "at least", self._times.low_us)
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Say that it stopped or never came."""
        if self._ident not in latest_us:
            yield f"no heartbeat of node {self._times.node} came"
        elif end_us - latest_us[self._ident] > self._times.high_us:
            yield self._said(end_us - latest_us[self._ident], "at most", self._times.high_us)

    def _said(self, gap_us: int, bound: str, limit_us: int) -> str:
        node, said = self._times.node, f"{bound} {ms_text(limit_us)} is right"
        return f"node {node}: {ms_text(gap_us)} ms since its last heartbeat, {said}"


LOST_AFTER: Final = 1.5
"""A heartbeat is lost after so many of its periods, as on the node board."""
LEAST_GAPS: Final = 2
GAPS_KEPT: Final = 9
GUARD_TOGGLE: Final = 0x80


class _Beats:
    """The heartbeats of one node on one bus.

    Attributes:
        gaps: between the latest of them.
        last_us: when it was heard last; None after a boot-up.
    """

    def __init__(self) -> None:
        self.gaps: deque[int] = deque(maxlen=GAPS_KEPT)
        self.last_us: int | None = None

    def overdue(self, at_us: int) -> tuple[int, int] | None:
        """Return time since the last one and learnt period; None while it is in time."""
        if self.last_us is None or len(self.gaps) < LEAST_GAPS:
            return None
        since_us, period_us = at_us - self.last_us, sorted(self.gaps)[len(self.gaps) // 2]
        return (since_us, period_us) if since_us > LOST_AFTER * period_us else None


class NoLostHeartbeat(Rule):
    """No heartbeat of any node that sends one is lost; its period is learnt from three of them.

    Answers to guarding requests are none: these have a toggle bit. A boot-up begins anew.
    """

    name = "no-lost-heartbeat"

    def __init__(self) -> None:
        self._beats: dict[tuple[str, int], _Beats] = {}
        self._guarded: set[tuple[str, int]] = set()

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of error control."""
        return ident in ERROR_CONTROL_IDS

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Compare the gap with those before."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        key = record.channel, frame.can_id - ERROR_CONTROL_COB_ID
        if len(frame.data) == 1 and frame.data[0] & GUARD_TOGGLE:
            self._guarded.add(key)
        if key in self._guarded or frame.data == BOOT_UP:
            self._beats.pop(key, None)
            return None
        beats = self._beats.setdefault(key, _Beats())
        overdue = beats.overdue(record.at_us)
        if beats.last_us is not None and record.at_us > beats.last_us:
            beats.gaps.append(record.at_us - beats.last_us)
        beats.last_us = record.at_us
        return None if overdue is None else _lost(key, overdue)

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Name the nodes that fell silent."""
        for key, beats in sorted(self._beats.items()):
            if (overdue := beats.overdue(end_us)) is not None:
                yield _lost(key, overdue)


def _lost(key: tuple[str, int], overdue: tuple[int, int]) -> str:
    channel, node = key
    since, period = map(ms_text, overdue)
    return f"{channel} node {node}: no heartbeat for {since} ms, one each {period} ms before"


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
        """Say that it stopped or never came."""
        if self._ident not in latest_us:
            yield f"{ident_text(self._ident)} never came"
        elif end_us - latest_us[self._ident] > self._most_us:
            yield self._said(end_us - latest_us[self._ident])

    def _said(self, gap_us: int) -> str:
        limit = f"at most {ms_text(self._most_us)} is right"
        return f"{ms_text(gap_us)} ms without {ident_text(self._ident)}, {limit}"
