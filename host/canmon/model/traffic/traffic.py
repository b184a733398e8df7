"""The traffic of all buses: one row for each identifier, one for each bus.

>>> traffic = Traffic()
>>> traffic.take(Record(0, "can0", CanFrame.parse("705#7F")))
>>> traffic.take(Record(100_000, "can0", CanFrame.parse("705#05")))
>>> row = traffic.snapshot().rows[0]
>>> row.frames, row.gap_us, row.changed.latest == 0x7F ^ 0x05
(2, 100000, True)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from tickrig.host.canmon.model.frames.ident import fd_ident, ident_of
from tickrig.host.canmon.model.frames.record import AnyFrame, Record
from tickrig.host.canmon.model.traffic.bit_rates import NO_RATES, BitRates
from tickrig.host.canmon.model.traffic.controller import ErrorRow, ErrorStatistics
from tickrig.host.canmon.model.traffic.tally import IdRow, Tally
from tickrig.wire.can import CanFrame
from tickrig.wire.can_bits import frame_bits
from tickrig.wire.can_error import ErrorFrame

WINDOW_US: Final = 1_000_000


class Window(NamedTuple):
    """A second of a bus.

    Attributes:
        at_us: its begin.
        bits: how many bits of frames ended in it.
    """

    at_us: int
    bits: int


class LoadRow(NamedTuple):
    """How busy a bus was. Error frames and broken frames are not in it: nobody tells their length.

    Attributes:
        bits: of all frames.
        latest: the latest second that is over, or the first one while it is not.
        peak: the busiest second, the first of them.
        mean_bit_s: bits a second from the first window to the one with the latest frame.
    """

    bits: int
    latest: Window
    peak: Window
    mean_bit_s: int


class Load:
    """Adds up the bits of each second, counted from the first frame.

    A frame with an earlier time than one before it counts for the window that is open.
    """

    __slots__ = ("_bits", "_ended", "_first_us", "_open", "_peak")

    def __init__(self, first_us: int) -> None:
        self._first_us, self._bits = first_us, 0
        self._open = self._ended = self._peak = Window(first_us, 0)

    def take(self, at_us: int, bits: int) -> Window | None:
        """Count a frame.

        Returns:
            The window that its time has ended, if any.
        """
        self._bits += bits
        begin_us, before = self._open
        if at_us < begin_us + WINDOW_US:
            self._open = Window(begin_us, before + bits)
            return None
        ended = self._ended = self._open
        self._peak = busier(self._peak, ended)
        self._open = Window(window_begin(self._first_us, at_us), bits)
        return ended

    def end(self) -> Window:
        """Return the window that is open."""
        return self._open

    def row(self, now_us: int) -> LoadRow:
        """Return how busy the bus was until now."""
        windows = (self._open.at_us - self._first_us) // WINDOW_US + 1
        return LoadRow(
            self._bits,
            self._latest(now_us),
            busier(self._peak, self._open),
            self._bits * 1_000_000 // (windows * WINDOW_US),
        )

    def _latest(self, now_us: int) -> Window:
        begin_us = window_begin(self._first_us, now_us) - WINDOW_US
        if begin_us < self._first_us:
            return self._open
        kept = (window for window in (self._open, self._ended) if window.at_us == begin_us)
        return next(kept, Window(begin_us, 0))


def window_begin(first_us: int, at_us: int) -> int:
    """Return the begin of the window of a time."""
    return at_us - (at_us - first_us) % WINDOW_US


def busier(first: Window, second: Window) -> Window:
    """Return the window with more bits, the first if they have the same."""
    return second if second.bits > first.bits else first


class BusRow(NamedTuple):
    """What one bus did.

    Attributes:
        channel: its name.
        frames: data and remote frames.
        first_us: when the first came, or the first error frame.
        last_us: when the latest came.
        load: how busy it was.
        errors: what error frames said.
        went_back: how many frames had an earlier time than the one before.
        fd: how many of the frames are of CAN FD.
        unrated: how many of these have data at a bit rate that nobody told: the load is less.
    """

    channel: str
    frames: int
    first_us: int
    last_us: int
    load: LoadRow
    errors: ErrorRow
    went_back: int
    fd: int = 0
    unrated: int = 0


class Snapshot(NamedTuple):
    """All rows at one moment; they never change.

    Attributes:
        at_us: the moment.
        buses: by name.
        rows: by bus and identifier.
    """

    at_us: int = 0
    buses: tuple[BusRow, ...] = ()
    rows: tuple[IdRow, ...] = ()


class BusTally:
    """Counts one bus."""

    def __init__(self, channel: str, first_us: int, rates: BitRates) -> None:
        self._channel = channel
        self._first_us = self._last_us = first_us
        self._ids: dict[int, Tally] = {}
        self._load, self._errors = Load(first_us), ErrorStatistics()
        self._frames = self._went_back = self._fd = self._unrated = 0
        self._rates = rates

    def take(self, at_us: int, frame: AnyFrame) -> None:
        """Count a frame."""
        if at_us < self._last_us:
            self._went_back += 1
        self._last_us = at_us
        measure: Callable[[Any], int] = frame_bits
        if isinstance(frame, CanFrame):
            ident = ident_of(frame)
        elif isinstance(frame, ErrorFrame):
            self._errors.take(frame)
            return
        else:
            ident, measure = fd_ident(frame), self._rates.bits
            self._fd += 1
            self._unrated += not self._rates.tells(frame)
        self._frames += 1
        tally = self._ids.get(ident)
        if tally is None:
            tally = self._ids[ident] = Tally(at_us, frame, measure)
        else:
            tally.take(at_us, frame)
        self._load.take(at_us, tally.length)

    def notch(self) -> None:
        """Take all bits that have changed as known."""
        for tally in self._ids.values():
            tally.memory.notch()

    def row(self, now_us: int) -> BusRow:
        """Return what the bus did."""
        return BusRow(
            self._channel,
            self._frames,
            self._first_us,
            self._last_us,
            self._load.row(now_us),
            self._errors.row(),
            self._went_back,
            self._fd,
            self._unrated,
        )

    def id_rows(self) -> list[IdRow]:
        """Return what its identifiers did, in their order."""
        return [tally.row(self._channel, ident) for ident, tally in sorted(self._ids.items())]


class Traffic:
    """Counts all frames of all buses; what it keeps grows with identifiers, not with frames.

    Not counted: what was lost before it was heard; see `Loss`.

    Args:
        rates: bit rates of all buses, for CAN FD.
    """

    def __init__(self, rates: BitRates = NO_RATES) -> None:
        self._buses: dict[str, BusTally] = {}
        self._rates = rates
        self._last_us = 0

    def take(self, record: Record) -> None:
        """Count a frame or an error frame."""
        at_us, channel, frame, _ = record
        bus = self._buses.get(channel)
        if bus is None:
            bus = self._buses[channel] = BusTally(channel, at_us, self._rates)
        bus.take(at_us, frame)
        self._last_us = at_us

    def clear(self) -> None:
        """Forget everything."""
        self._buses.clear()

    def notch(self) -> None:
        """Take all bits that have changed as known: only others are shown from now on."""
        for bus in self._buses.values():
            bus.notch()

    def snapshot(self, now_us: int | None = None) -> Snapshot:
        """Return all rows.

        Args:
            now_us: the time; that of the latest frame if it is not given.
        """
        at_us = self._last_us if now_us is None else now_us
        buses = [self._buses[name] for name in sorted(self._buses)]
        rows = tuple(row for bus in buses for row in bus.id_rows())
        return Snapshot(at_us, self.buses(at_us), rows)

    def buses(self, now_us: int) -> tuple[BusRow, ...]:
        """Return the rows of the buses alone, which takes less time."""
        return tuple(self._buses[name].row(now_us) for name in sorted(self._buses))
