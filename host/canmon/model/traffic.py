"""The traffic of all buses, with one row for each identifier, and one row for each bus.

>>> traffic = Traffic()
>>> traffic.take(Record(0, "can0", can.CanFrame.parse("705#7F")))
>>> traffic.take(Record(100_000, "can0", can.CanFrame.parse("705#05")))
>>> row = traffic.snapshot().rows[0]
>>> row.frames, row.gap_us, row.changed.latest == 0x7F ^ 0x05
(2, 100000, True)

The module counts the times between frames of one identifier.

>>> bucket_of(100), bucket_of(10_000), bucket_range(bucket_of(10_000))
(100, 526, (9984, 10111))

The module also holds the bit rates of a bus, and the duration of a CAN FD frame at these rates.

>>> frame = can.FdFrame.parse("123##1AABB")
>>> BitRates(500_000, 2_000_000).bits(frame), BitRates().bits(frame)
(42, 78)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, reduce
from operator import or_
from typing import Any, Final, NamedTuple

from tickrig.host.canmon.model.frames import AnyFrame, Record, fd_ident, ident_of
from tickrig.wire import can

SUB_BITS: Final = 6
EXACT_US: Final = 1 << SUB_BITS + 1
"""Time below which each time has a bucket of its own."""

_KEPT: Final = 2_048
"""Number of buckets whose middle is cached, which are all buckets below an hour."""


def bucket_of(time_us: int) -> int:
    """Return the bucket of a time of 0 or more."""
    if time_us < EXACT_US:
        return time_us
    shift = time_us.bit_length() - SUB_BITS - 1
    return (shift << SUB_BITS) + (time_us >> shift)


def bucket_range(bucket: int) -> tuple[int, int]:
    """Return the shortest and the longest time of a bucket."""
    if bucket < EXACT_US:
        return bucket, bucket
    shift = (bucket >> SUB_BITS) - 1
    low = (bucket & (1 << SUB_BITS) - 1 | 1 << SUB_BITS) << shift
    return low, low + (1 << shift) - 1


@lru_cache(maxsize=_KEPT)
def middle_us(bucket: int) -> int:
    """Return the time in the middle of a bucket."""
    low, high = bucket_range(bucket)
    return (low + high) // 2


def quantile(counts: Mapping[int, int], per_mille: int) -> int:
    """Return the bucket of a histogram that contains a quantile of the counted values.

    Args:
        counts: number of values in each bucket. There is at least one value.
        per_mille: quantile in per mille, counted from the lowest value, 1 to 1000.
    """
    rank = -(-sum(counts.values()) * per_mille // 1_000)
    for bucket in sorted(counts):
        rank -= counts[bucket]
        if rank <= 0:
            return bucket
    raise ValueError("no values")


_MEDIAN: Final = 500
_P99: Final = 990

_NEAR_CYCLE: Final = 4
"""Divisor of the cycle. A gap near the cycle differs from it by at most this part."""

_CYCLIC_PERCENT: Final = 75
"""Percentage of gaps that must be near the cycle. Otherwise there is no cycle."""


class GapRow(NamedTuple):
    """Statistics of the gaps, the times between successive frames with the same CAN-ID.

    All times are in microseconds.

    Attributes:
        min_us: shortest gap.
        mean_us: mean of the gaps, rounded down.
        p99_us: quantile of 99 %: at most 1 % of the gaps were longer. The value is at most 1/64 too
            long.
        max_us: longest gap.
        jitter_us: mean difference between a gap and the previous gap, rounded down.
        cycle_us: period of cyclic frames, corrected for missed frames, or None if the frames are
            not cyclic. Frames are cyclic if three quarters of the gaps are within a quarter of the
            median.
        missed: upper limit of the number of frames that were missed in that cycle, or None if the
            frames are not cyclic.
    """

    min_us: int
    mean_us: int
    p99_us: int
    max_us: int
    jitter_us: int
    cycle_us: int | None
    missed: int | None


class Gaps:
    """Counter of the gaps between frames with the same CAN-ID.

    The memory does not grow with the number of gaps, because gaps are counted in buckets of a
    histogram. All times are in microseconds.

    Attributes:
        count: number of gaps.
        total_us: sum of the gaps.
        min_us: shortest gap.
        max_us: longest gap.
        wander_us: sum of the absolute differences between each gap and the previous gap.
        buckets: number of gaps in each bucket of the histogram.
    """

    __slots__ = ("_last_us", "buckets", "count", "max_us", "min_us", "total_us", "wander_us")

    def __init__(self) -> None:
        self.count = self.total_us = self.min_us = self.max_us = self.wander_us = 0
        self.buckets: dict[int, int] = {}
        self._last_us = 0

    def take(self, gap_us: int) -> None:
        """Count a gap, 0 or more."""
        if not self.count:
            self.min_us = self.max_us = self._last_us = gap_us
        elif gap_us < self.min_us:
            self.min_us = gap_us
        elif gap_us > self.max_us:
            self.max_us = gap_us
        self.count += 1
        self.total_us += gap_us
        self.wander_us += abs(gap_us - self._last_us)
        self._last_us = gap_us
        bucket = bucket_of(gap_us)
        self.buckets[bucket] = self.buckets.get(bucket, 0) + 1

    def row(self) -> GapRow | None:
        """Return the statistics of the gaps, or None before the first gap."""
        if not self.count:
            return None
        p99_us = min(self.max_us, bucket_range(quantile(self.buckets, _P99))[1])
        about_us = self._median_if_cyclic()
        missed = None if about_us is None else self._missed(about_us)
        return GapRow(
            self.min_us,
            self.total_us // self.count,
            p99_us,
            self.max_us,
            self.wander_us // max(1, self.count - 1),
            None if missed is None else self.total_us // (self.count + missed),
            missed,
        )

    def _median_if_cyclic(self) -> int | None:
        cycle_us = middle_us(quantile(self.buckets, _MEDIAN))
        near = sum(
            count
            for bucket, count in self.buckets.items()
            if abs(middle_us(bucket) - cycle_us) * _NEAR_CYCLE <= cycle_us
        )
        return cycle_us if cycle_us and near * 100 >= self.count * _CYCLIC_PERCENT else None

    def _missed(self, cycle_us: int) -> int:
        """Count whole cycles without a frame. A gap of 1.5 to 2.5 cycles missed one frame."""
        return sum(
            count * max(0, (2 * middle_us(bucket) + cycle_us) // (2 * cycle_us) - 1)
            for bucket, count in self.buckets.items()
        )


# All that is counted of the frames of one identifier.

PAYLOAD_BITS: Final = 64


class BitRow(NamedTuple):
    """Statistics of the bits that changed in the payloads of one CAN-ID.

    A set of bits is stored as an integer: bit 0 of byte 0 is bit 0, and bit 7 of byte 7 is bit 63.
    In CAN FD, the bits continue to bit 511.

    Attributes:
        latest: bits in which the latest payload differs from the previous one.
        planes: counters of the changes of each payload bit, stored by binary digit. The integer
            `planes[n]` is a set of bits: bit b is set if digit n of the counter of payload bit b is
            1. `counts` returns the counters as normal numbers.
        notched: bits whose changes the user marked as known, so they are not shown.
    """

    latest: int = 0
    planes: tuple[int, ...] = ()
    notched: int = 0

    @property
    def changed(self) -> int:
        """Bits that have ever changed and are not notched."""
        return reduce(or_, self.planes, 0) & ~self.notched

    def counts(self) -> tuple[int, ...]:
        """Return the number of changes of each payload bit, in order from bit 0 of byte 0.

        The result has 64 counts. In CAN FD, it has the counts of all bits up to the highest changed
        bit.

        >>> BitRow(planes=(0b01, 0b11)).counts()[:3]
        (3, 2, 0)
        """
        highest = max(map(int.bit_length, self.planes), default=0)
        return tuple(
            sum((plane >> bit & 1) << place for place, plane in enumerate(self.planes))
            for bit in range(max(PAYLOAD_BITS, -(-highest // 8) * 8))
        )


class BitMemory:
    """Counter of the changes of each payload bit of one CAN-ID.

    A payload that is shorter than the previous one is padded with zeros.

    Attributes:
        notched: bits whose changes the user marked as known, so they are not shown.
    """

    __slots__ = ("_latest", "_payload", "_planes", "notched")

    def __init__(self, payload: int) -> None:
        self._payload, self._latest, self.notched = payload, 0, 0
        # All counters are updated at once: each integer holds one binary digit of all counters.
        self._planes: list[int] = []

    def take(self, payload: int) -> None:
        """Compare a payload with the previous one."""
        self._latest = carry = payload ^ self._payload
        self._payload = payload
        planes, place = self._planes, 0
        while carry:
            if place == len(planes):
                planes.append(0)
            planes[place], carry = planes[place] ^ carry, planes[place] & carry
            place += 1

    def same(self) -> None:
        """Record that the payload was repeated without a change."""
        self._latest = 0

    def notch(self) -> None:
        """Treat all bits that have changed as known."""
        self.notched |= reduce(or_, self._planes, 0)

    def row(self) -> BitRow:
        """Return the changes."""
        return BitRow(self._latest, tuple(self._planes), self.notched)


class IdRow(NamedTuple):
    """Statistics of the traffic with one CAN-ID on one bus.

    Attributes:
        channel: name of the bus.
        ident: CAN-ID with flags, as `ident_of` and `fd_ident` return it.
        frames: number of frames.
        first_us: time of the first frame.
        last_us: time of the latest frame.
        frame: latest frame.
        gap_us: time between the two latest frames in microseconds, or None before the second frame.
        gaps: statistics of all gaps, or None before the second frame.
        bits: total number of bits that all frames needed on the bus. For CAN FD frames,
            `BitRates.bits` calculates the number.
        changed: statistics of the payload bits that changed.
    """

    channel: str
    ident: int
    frames: int
    first_us: int
    last_us: int
    frame: can.CanFrame | can.FdFrame
    gap_us: int | None
    gaps: GapRow | None
    bits: int
    changed: BitRow

    @property
    def rate_hz(self) -> float:
        """Average number of frames per second from the first to the latest frame.

        The rate is 0 if both have the same time.
        """
        span_us = self.last_us - self.first_us
        return (self.frames - 1) * 1e6 / span_us if span_us > 0 else 0.0


class _IdTally:
    """Counter for the frames of one identifier on one bus.

    A frame with an earlier time than the previous frame has a gap of 0.

    Args:
        at_us: time of the first frame.
        frame: first frame. The following frames are of the same kind.
        measure: function that returns the number of bits of a frame on the bus.

    Attributes:
        length: number of bits of the latest frame on the bus.
        memory: changes of the payload bits.
    """

    __slots__ = (
        *("_bits", "_first_us", "_frame", "_gap_us", "_gaps", "_last_us", "_measure"),
        *("length", "memory"),
    )

    def __init__(
        self,
        at_us: int,
        frame: can.CanFrame | can.FdFrame,
        measure: Callable[[Any], int] = can.frame_bits,
    ) -> None:
        self._first_us = self._last_us = at_us
        self._frame, self._gaps, self._measure = frame, Gaps(), measure
        self.length = self._bits = measure(frame)
        self._gap_us: int | None = None
        self.memory = BitMemory(int.from_bytes(frame.data, "little"))

    def take(self, at_us: int, frame: can.CanFrame | can.FdFrame) -> None:
        """Count a frame after the first one."""
        gap_us = self._gap_us = max(0, at_us - self._last_us)
        self._last_us = at_us
        self._gaps.take(gap_us)
        if frame == self._frame:
            self.memory.same()
        else:
            self._frame, self.length = frame, self._measure(frame)
            self.memory.take(int.from_bytes(frame.data, "little"))
        self._bits += self.length

    def row(self, channel: str, ident: int) -> IdRow:
        """Return the counts."""
        return IdRow(
            channel,
            ident,
            self._gaps.count + 1,
            self._first_us,
            self._last_us,
            self._frame,
            self._gap_us,
            self._gaps.row(),
            self._bits,
            self.memory.row(),
        )


class BitRates(NamedTuple):
    """Bit rates of a CAN bus in bit/s, for the calculation of bus load. None is an unknown rate.

    Attributes:
        nominal: bit rate of classic frames, and of the arbitration phase of CAN FD frames.
        fast: bit rate of the data phase of CAN FD frames with bit rate switch (BRS).
    """

    nominal: int | None = None
    fast: int | None = None

    def tells(self, frame: can.FdFrame) -> bool:
        """Return whether the rates of all parts of a frame are known."""
        return not frame.brs or bool(self.nominal and self.fast)

    def bits(self, frame: can.FdFrame) -> int:
        """Return the duration of a CAN FD frame on the bus, in bits of the nominal rate.

        The number is rounded up. If a rate is unknown, the bits of the data phase are counted as
        bits of the nominal rate. The result is then longer than the real duration.
        """
        nominal, fast = can.fd_bits(frame)
        if self.nominal and self.fast:
            return nominal - (-fast * self.nominal // self.fast)
        return nominal + fast


NO_RATES: Final = BitRates()


# Information in error frames about a bus and about our own controller.

_OVERFLOW: Final = can.ControllerFlag.RECEIVE_OVERFLOW
_PASSIVE: Final = can.ControllerFlag.RECEIVE_PASSIVE | can.ControllerFlag.TRANSMIT_PASSIVE


class _ErrorRow(NamedTuple):
    """The error frames of a bus.

    Attributes:
        frames: number of error frames.
        state: state of the local controller in the latest error frame, or None if unknown.
        tec: transmit error counter of the local controller, or None if unknown.
        rec: receive error counter of the local controller, or None if unknown.
        overflows: number of overflows of the controller's receive buffer, which lose frames.
        kinds: kinds of the error frames with counts. The most frequent kind is first.
    """

    frames: int = 0
    state: can.ErrorState | None = None
    tec: int | None = None
    rec: int | None = None
    overflows: int = 0
    kinds: tuple[tuple[str, int], ...] = ()


class ErrorStatistics:
    """Statistics of the error frames of a bus."""

    __slots__ = ("_frames", "_kinds", "_overflows", "_rec", "_state", "_tec")

    def __init__(self) -> None:
        self._frames = self._overflows = 0
        self._state: can.ErrorState | None = None
        self._tec: int | None = None
        self._rec: int | None = None
        self._kinds: dict[str, int] = {}

    def take(self, frame: can.ErrorFrame) -> None:
        """Count an error frame."""
        self._frames += 1
        kind = can.describe_error_frame(frame)
        self._kinds[kind] = self._kinds.get(kind, 0) + 1
        controller = frame.error_class & can.ErrorClass.CONTROLLER
        flags = frame.data[can.CONTROLLER_BYTE] if controller else 0
        state = _state_after(frame.error_class, flags)
        self._state = self._state if state is None else state
        if frame.error_class & can.ErrorClass.COUNTERS:
            self._tec, self._rec = frame.data[can.TEC_BYTE], frame.data[can.REC_BYTE]
        self._overflows += bool(flags & _OVERFLOW)

    def row(self) -> _ErrorRow:
        """Return the statistics of the error frames."""
        kinds = sorted(self._kinds.items(), key=lambda item: (-item[1], item[0]))
        return _ErrorRow(
            self._frames, self._state, self._tec, self._rec, self._overflows, tuple(kinds)
        )


def _state_after(error_class: int, flags: int) -> can.ErrorState | None:
    """Return the state of the local controller after an error frame, or None if it is unknown."""
    if error_class & can.ErrorClass.BUS_OFF:
        return can.ErrorState.BUS_OFF
    if flags & _PASSIVE:
        return can.ErrorState.PASSIVE
    if flags & can.ControllerFlag.ACTIVE or error_class & can.ErrorClass.RESTARTED:
        return can.ErrorState.ACTIVE
    return None


WINDOW_US: Final = 1_000_000
LEAST_WINDOW_US: Final = 500_000
"""Shortest last second that is judged by its own time. A shorter one may be a burst of frames."""


def bits_per_second(bits: int, span_us: int) -> int:
    """Return the mean load over a time span in bits per second.

    A span of 0, from frames that all have the same time, is replaced by one second.

    >>> bits_per_second(6_861, 490_000), bits_per_second(111, 0)
    (14002, 111)
    """
    return bits * 1_000_000 // (span_us or WINDOW_US)


class BusSecond(NamedTuple):
    """Amount of traffic on one bus within one second.

    Attributes:
        at_us: start of the second in microseconds.
        bits: number of bits of the frames that ended in this second.
        span_us: duration in microseconds, which is shorter if the traffic ends within the second.
    """

    at_us: int
    bits: int
    span_us: int = WINDOW_US

    @property
    def bit_s(self) -> int:
        """Load in bits per second."""
        return bits_per_second(self.bits, self.span_us)


class _LoadRow(NamedTuple):
    """The load of a bus. Error frames and broken frames have no known length, and do not count.

    Attributes:
        bits: bits of all frames.
        latest: latest complete second, or the first second while it lasts.
        peak: busiest second, or the first of several equally busy seconds.
        mean_bit_s: mean bits per second, from the first frame to the latest one.
    """

    bits: int
    latest: BusSecond
    peak: BusSecond
    mean_bit_s: int


class Load:
    """Bus load: counter of the bits in each second, counted from the first frame.

    If the time of a frame is before that of a previous frame, its bits count for the current
    second.

    Attributes:
        begin_us: start of the current second in microseconds.
    """

    __slots__ = ("_bits", "_ended", "_first_us", "_open_bits", "_peak", "begin_us")

    def __init__(self, first_us: int) -> None:
        self._first_us = self.begin_us = first_us
        self._bits = self._open_bits = 0
        self._ended = self._peak = BusSecond(first_us, 0)

    def take(self, at_us: int, bits: int) -> BusSecond | None:
        """Count the bits of a frame.

        If the frame is later than the current second, this second is complete, and the frame begins
        a new second.

        Returns:
            The completed second, or None if no second was completed.
        """
        self._bits += bits
        if at_us < self.begin_us + WINDOW_US:
            self._open_bits += bits
            return None
        ended = self._ended = BusSecond(self.begin_us, self._open_bits)
        self._peak = max(self._peak, ended, key=lambda second: second.bits)
        self.begin_us, self._open_bits = _window_begin(self._first_us, at_us), bits
        return ended

    def end(self, end_us: int) -> BusSecond:
        """Return the last second of the traffic, with the number of its bits and its duration.

        The traffic may end before the second is complete. If it lasts at least `LEAST_WINDOW_US` in
        this second, the result contains this real duration. Otherwise, the result contains the
        duration of a full second. The load is calculated from the bits and the duration.

        Args:
            end_us: end of the traffic in microseconds.
        """
        span_us = min(end_us - self.begin_us, WINDOW_US)
        return self._open(span_us if span_us >= LEAST_WINDOW_US else WINDOW_US)

    def row(self, now_us: int, last_us: int, *, ended: bool = False) -> _LoadRow:
        """Return the load of the bus until now.

        Args:
            now_us: present time in microseconds.
            last_us: time of the latest frame or error frame in microseconds.
            ended: whether the traffic has ended. If True, the load of the last second is calculated
                as in `end`, because this second may be incomplete.
        """
        span_us = max(last_us, self.begin_us) - self._first_us
        last = self.end(last_us) if ended else self._open(WINDOW_US)
        if span_us < WINDOW_US:
            last = self._open(span_us or WINDOW_US)
        return _LoadRow(
            self._bits,
            self._latest(now_us),
            max(self._peak, last, key=lambda second: second.bit_s),
            bits_per_second(self._bits, span_us),
        )

    def _open(self, span_us: int) -> BusSecond:
        return BusSecond(self.begin_us, self._open_bits, span_us)

    def _latest(self, now_us: int) -> BusSecond:
        begin_us = _window_begin(self._first_us, now_us) - WINDOW_US
        if begin_us < self._first_us:
            return self._open(max(now_us - self._first_us, 0) or WINDOW_US)
        kept = (one for one in (self._open(WINDOW_US), self._ended) if one.at_us == begin_us)
        return next(kept, BusSecond(begin_us, 0))


def _window_begin(first_us: int, at_us: int) -> int:
    """Return the start of the window that contains a time."""
    return at_us - (at_us - first_us) % WINDOW_US


class BusRow(NamedTuple):
    """Statistics of the traffic on one bus, for the display of bus load and errors.

    Attributes:
        channel: name of the bus.
        frames: number of data and remote frames.
        first_us: time of the first frame or error frame.
        last_us: time of the latest frame or error frame.
        load: load of the bus.
        errors: statistics of the error frames.
        went_back: number of frames whose time is earlier than that of the previous frame.
        fd: number of CAN FD frames.
        unrated: number of CAN FD frames whose data was sent at an unknown bit rate. If it is not 0,
            the real load is lower than the calculated load.
    """

    channel: str
    frames: int
    first_us: int
    last_us: int
    load: _LoadRow
    errors: _ErrorRow
    went_back: int
    fd: int = 0
    unrated: int = 0


class TrafficSnapshot(NamedTuple):
    """Statistics of all traffic at one moment. The snapshot does not change with later traffic.

    Attributes:
        at_us: time of the snapshot in microseconds.
        buses: statistics of the buses, sorted by name.
        rows: statistics of the CAN-IDs of each bus, sorted by bus and CAN-ID with flags.
    """

    at_us: int = 0
    buses: tuple[BusRow, ...] = ()
    rows: tuple[IdRow, ...] = ()


class _BusTally:
    """Counter for one bus."""

    def __init__(self, channel: str, first_us: int, rates: BitRates) -> None:
        self._channel = channel
        self._first_us = self._last_us = first_us
        self._ids: dict[int, _IdTally] = {}
        self._load, self._errors = Load(first_us), ErrorStatistics()
        self._frames = self._went_back = self._fd = self._unrated = 0
        self._rates = rates

    def take(self, at_us: int, frame: AnyFrame) -> None:
        """Count a frame."""
        if at_us < self._last_us:
            self._went_back += 1
        self._last_us = at_us
        measure: Callable[[Any], int] = can.frame_bits
        if isinstance(frame, can.CanFrame):
            ident = ident_of(frame)
        elif isinstance(frame, can.ErrorFrame):
            self._errors.take(frame)
            return
        else:
            ident, measure = fd_ident(frame), self._rates.bits
            self._fd += 1
            self._unrated += not self._rates.tells(frame)
        self._frames += 1
        tally = self._ids.get(ident)
        if tally is None:
            tally = self._ids[ident] = _IdTally(at_us, frame, measure)
        else:
            tally.take(at_us, frame)
        self._load.take(at_us, tally.length)

    def notch(self) -> None:
        """Treat all bits that have changed as known."""
        for tally in self._ids.values():
            tally.memory.notch()

    def row(self, now_us: int, *, ended: bool) -> BusRow:
        """Return the statistics of the bus."""
        return BusRow(
            self._channel,
            self._frames,
            self._first_us,
            self._last_us,
            self._load.row(now_us, self._last_us, ended=ended),
            self._errors.row(),
            self._went_back,
            self._fd,
            self._unrated,
        )

    def id_rows(self) -> list[IdRow]:
        """Return the statistics of the identifiers in their order."""
        return [tally.row(self._channel, ident) for ident, tally in sorted(self._ids.items())]


class Traffic:
    """Counter of all frames on all buses. `snapshot` returns the statistics.

    The memory grows with the number of CAN-IDs, not with the number of frames. Frames that were
    lost before they were read are not counted; see `Loss`.

    Args:
        rates: bit rates of all buses, used for CAN FD.
    """

    def __init__(self, rates: BitRates = NO_RATES) -> None:
        self._buses: dict[str, _BusTally] = {}
        self._rates = rates
        self._last_us = 0

    def take(self, record: Record) -> None:
        """Count a frame or an error frame."""
        at_us, channel, frame, _ = record
        bus = self._buses.get(channel)
        if bus is None:
            bus = self._buses[channel] = _BusTally(channel, at_us, self._rates)
        bus.take(at_us, frame)
        self._last_us = at_us

    def clear(self) -> None:
        """Delete all counts."""
        self._buses.clear()

    def notch(self) -> None:
        """Hide further changes of all payload bits that have changed until now.

        From then on, only changes of other payload bits are shown.
        """
        for bus in self._buses.values():
            bus.notch()

    def snapshot(self, now_us: int | None = None) -> TrafficSnapshot:
        """Return the present statistics of all buses and CAN-IDs.

        Args:
            now_us: present time in microseconds. None means that the traffic has ended. Then the
                time of the latest frame is used.
        """
        at_us = self._last_us if now_us is None else now_us
        buses = [self._buses[name] for name in sorted(self._buses)]
        rows = tuple(row for bus in buses for row in bus.id_rows())
        return TrafficSnapshot(at_us, self.buses(at_us, ended=now_us is None), rows)

    def buses(self, now_us: int, *, ended: bool = False) -> tuple[BusRow, ...]:
        """Return the rows of the buses. This takes less time than `snapshot`.

        Args:
            now_us: present time in microseconds.
            ended: whether the traffic has ended. If True, the last second may be incomplete, and
                its load is calculated as in `Load.end`.
        """
        return tuple(self._buses[name].row(now_us, ended=ended) for name in sorted(self._buses))
