"""The activity on buses over the time of a log, in as much detail as a page can show.

>>> bins = TimeBins(most=4, width_us=10)
>>> for at_us in (0, 5, 12, 35, 77):
...     bins.add("181", at_us, 1)
>>> bins.width_us, bins.sums["181"]
(20, {0: 3, 1: 1, 3: 1})
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Final, Generic, NamedTuple, TypeVar

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal, Transfer, TransferOutcome
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.model.decode.node_memory import drive_state
from tickrig.host.canmon.model.decode.services import nmt_state_name
from tickrig.host.canmon.model.frames import Record, any_ident
from tickrig.host.canmon.model.traffic import BitRates
from tickrig.wire.can import ErrorFrame, FdFrame, frame_bits
from tickrig.wire.canopen.nmt import NmtState

# Theory of operation
# ===================
#
# A log may hold ten million frames, a page a few thousand marks. So nothing here grows with
# the frames: what is counted goes into bins of equal width, and when there are too many bins,
# two become one (`TimeBins`). What is a mark (an EMCY, a transfer) is kept one by one up to a
# number, then every second one, every fourth (`Thinned`); how many there were stays exact.
# States are changes, and of the changes in one span of time the last one counts (`_Bands`).
#
# There are two ways in, as everywhere in canmon: `Survey.take` frame by frame, and
# `ColumnSurvey` in blocks of numpy. Both let `NodeBoard` follow the nodes; a survey is a board
# that remembers when. Times are relative to the first frame; one before it counts as 0.

_T = TypeVar("_T")
_Key = TypeVar("_Key")

_MOST_BINS: Final = 2_000
_FIRST_WIDTH_US: Final = 1_000
_MOST_MARKS: Final = 1_000
_MOST_SIGNALS: Final = 400


class TimeBins(Generic[_Key]):
    """Sums over time. The time axis is divided into spans of equal width.

    Each span has one sum for each key, such as the number of bits on each bus.

    If a later time would need too many spans, the width is doubled and the spans are merged. The
    memory is therefore limited.

    Args:
        most: maximum number of spans.
        width_us: initial width of a span in microseconds.

    Attributes:
        width_us: present width of a span in microseconds.
        sums: sums of the amounts that `add` got. Each key has a dictionary with the sums by number
            of the span.
        ranges: least and greatest of the values that `spread_at` got. They are independent of the
            sums. Each key has a dictionary with the two values by number of the span.
    """

    def __init__(self, most: int = _MOST_BINS, width_us: int = _FIRST_WIDTH_US) -> None:
        self._most, self.width_us = most, width_us
        self.sums: dict[_Key, dict[int, int]] = {}
        self.ranges: dict[_Key, dict[int, tuple[float, float]]] = {}

    def reach(self, at_us: int) -> None:
        """Make sure that one of the spans can contain the time `at_us`.

        If this would need too many spans, they are merged into wider spans.
        """
        shift = (at_us // self.width_us // self._most).bit_length()
        if not shift:
            return
        self.width_us <<= shift
        sums, ranges, self.sums, self.ranges = self.sums, self.ranges, {}, {}
        for key, amounts in sums.items():
            for place, amount in amounts.items():
                self.add_at(key, place >> shift, amount)
        for key, spans in ranges.items():
            for place, (low, high) in spans.items():
                self.spread_at(key, place >> shift, low, high)

    def add(self, key: _Key, at_us: int, amount: int) -> None:
        """Add an amount to the span that contains a time."""
        self.reach(at_us)
        self.add_at(key, at_us // self.width_us, amount)

    def add_at(self, key: _Key, place: int, amount: int) -> None:
        """Add to a span by its index. Call `reach` first."""
        spans = self.sums.setdefault(key, {})
        spans[place] = spans.get(place, 0) + amount

    def spread_at(self, key: _Key, place: int, low: float, high: float) -> None:
        """Extend the range of a span to include these values. Call `reach` first."""
        spans = self.ranges.setdefault(key, {})
        was = spans.get(place)
        spans[place] = (low, high) if was is None else (min(was[0], low), max(was[1], high))


class Thinned(Generic[_T]):
    """A list with limited memory, which keeps a regular sample of the items that are added.

    If there are many items, only every second, then every fourth item is kept.

    Attributes:
        items: items that are kept, in order of addition.
        count: number of all items that were added.
    """

    def __init__(self, most: int = _MOST_MARKS) -> None:
        self._most, self._step = most, 1
        self.items: list[_T] = []
        self.count = 0

    def append(self, item: _T) -> None:
        """Add one more item."""
        if self.count % self._step == 0:
            self.items.append(item)
            if len(self.items) > 2 * self._most:
                del self.items[1::2]
                self._step *= 2
        self.count += 1

    def pass_over(self) -> bool:
        """Count the next item without creating it, if the list would not keep it.

        Returns:
            True if the item was counted. The caller then need not create it. False if the list
            would keep the item. The caller must then create it and call `append`.
        """
        if self.count % self._step == 0:
            return False
        self.count += 1
        return True


class _Bands:
    """States with their start times. Of several states in one span of time, the last one is kept.

    Attributes:
        changes: time and state of each change, in order.
        count: number of all changes.
    """

    def __init__(self, most: int = _MOST_MARKS) -> None:
        self._most, self._width_us = most, 1
        self.changes: list[tuple[int, str]] = []
        self.count = 0

    def take(self, at_us: int, state: str) -> None:
        """Add a state. The same state again is not a change."""
        if self.changes and self.changes[-1][1] == state:
            return
        self.count += 1
        if self.changes and self.changes[-1][0] // self._width_us == at_us // self._width_us:
            self.changes[-1] = self.changes[-1][0], state
            return
        self.changes.append((at_us, state))
        while len(self.changes) > 2 * self._most:
            self._width_us *= 2
            last = {when // self._width_us: (when, what) for when, what in self.changes}
            self.changes = list(last.values())


class SignalName(NamedTuple):
    """The name of a signal, either in a PDO of a node, or in a message of a DBC file."""

    channel: str
    node: int | None
    kind: str
    name: str


@dataclass(slots=True)
class SignalTrack:
    """Summary of the values that one signal had in a recording.

    The values over time are stored elsewhere, in `TimeBins`.

    Attributes:
        unit: unit of the values.
        source: source of the signal's name, such as an EDS or a DBC file.
        count: number of values that were received.
        low, high: least and greatest value.
        states: states over time, if the values of the signal have names, or None for a numeric
            signal.
    """

    unit: str = ""
    source: str = ""
    count: int = 0
    low: float = 0.0
    high: float = 0.0
    states: _Bands | None = None

    def take(self, count: int, low: float, high: float) -> None:
        """Count values."""
        self.low = min(self.low, low) if self.count else low
        self.high = max(self.high, high) if self.count else high
        self.count += count


class Mark(NamedTuple):
    """An event of a CANopen node that the time chart of the node shows.

    Attributes:
        at_us: time since the first frame in microseconds.
        text: description of the event.
        span_us: duration of the event in microseconds.
    """

    at_us: int
    text: str
    span_us: int = 0


@dataclass(slots=True)
class _NodeLane:
    """The history of one node.

    Attributes:
        states: NMT states that the node reported or that were commanded.
        boots: boot-ups of the node.
        commands: NMT commands to the node.
        emcys: EMCY messages of the node.
        transfers: successful SDO transfers.
        failures: failed SDO transfers.
        gaps: times without a due heartbeat. Each time starts at the last heartbeat.
    """

    states: _Bands = field(default_factory=_Bands)
    boots: Thinned[Mark] = field(default_factory=Thinned)
    commands: Thinned[Mark] = field(default_factory=Thinned)
    emcys: Thinned[Mark] = field(default_factory=Thinned)
    transfers: Thinned[Mark] = field(default_factory=Thinned)
    failures: Thinned[Mark] = field(default_factory=Thinned)
    gaps: Thinned[Mark] = field(default_factory=Thinned)


class Survey(NodeBoard):
    """A node board that also stores the history.

    Args:
        decoder: decoder of the frames that the survey processes.
        expected: nodes with an EDS, as for `NodeBoard`.
        rates: bit rates of the buses, used for the length of CAN FD frames.

    Attributes:
        first_us: time of the first frame, or None before it.
        last_us: time of the latest frame.
        frames: number of frames by bus.
        counts: number of frames by bus and identifier.
        bits: number of bits on each bus.
        errors: number of error frames on each bus.
        values: values of signals in bins.
        lanes: lanes of nodes by bus and node-ID.
        signals: signals by name.
        signals_left: names of signals that were left out because there were too many.
    """

    def __init__(
        self,
        decoder: Decoder,
        expected: Mapping[int, str] | None = None,
        rates: BitRates | None = None,
    ) -> None:
        super().__init__(decoder, expected)
        self._rates = rates or BitRates()
        self.first_us: int | None = None
        self.last_us = 0
        self.frames: dict[str, int] = {}
        self.counts = TimeBins[tuple[str, int]]()
        self.bits = TimeBins[str]()
        self.errors = TimeBins[str]()
        self.values = TimeBins[SignalName]()
        self.lanes: defaultdict[tuple[str, int], _NodeLane] = defaultdict(_NodeLane)
        self.signals: dict[SignalName, SignalTrack] = {}
        self.signals_left: set[SignalName] = set()

    def since(self, at_us: int) -> int:
        """Return a time since the first frame, which is at least 0."""
        return max(0, at_us - (self.first_us or 0))

    def begin(self, at_us: int) -> None:
        """Record the time of the first frame."""
        if self.first_us is None:
            self.first_us = self.last_us = at_us

    def reach(self, since_us: int) -> int:
        """Make sure that all bins contain a time. Return the index of its span."""
        for bins in (self.counts, self.bits, self.errors, self.values):
            bins.reach(since_us)
        return since_us // self.bits.width_us

    def count(self, record: Record) -> None:
        """Count a frame."""
        at_us, channel, frame, _ = record
        self.begin(at_us)
        self.last_us, since_us = max(self.last_us, at_us), self.since(at_us)
        self.frames[channel] = self.frames.get(channel, 0) + 1
        place = self.reach(since_us)
        if isinstance(frame, ErrorFrame):
            self.errors.add_at(channel, place, 1)
            return
        bits = self._rates.bits(frame) if isinstance(frame, FdFrame) else frame_bits(frame)
        self.counts.add_at((channel, any_ident(frame)), place, 1)
        self.bits.add_at(channel, place, bits)

    def take(self, record: Record, decoded: Decoded) -> None:
        """Process a decoded frame: add its events to the chart of its node.

        The frame itself is not counted here.
        """
        kind, node, channel = decoded.kind, decoded.node, record.channel
        since_us = self.since(record.at_us)
        row = None if node is None else self.row(channel, node)
        told_us, late = (None, 0) if row is None else (row.heartbeats.last_us, row.late)
        if row and kind == "boot-up":
            late -= row.is_late(record.at_us)  # the board does not count it after a reset
        super().take(record, decoded)
        if row and told_us is not None and row.late > late:
            self._gap(channel, row.node, told_us, record.at_us)
        if kind == "nmt":
            self._take_command(channel, since_us, decoded)
        elif node is None:
            return
        elif kind == "emcy":
            self.lanes[channel, node].emcys.append(Mark(since_us, decoded.text))
        elif kind == "sdo":
            for transfer in decoded.transfers:
                self._take_transfer(channel, node, transfer)
        elif kind == "boot-up":
            lane = self.lanes[channel, node]
            lane.boots.append(Mark(since_us, "boot-up"))
            lane.states.take(since_us, nmt_state_name(NmtState.PRE_OPERATIONAL))
        elif kind in ("heartbeat", "guard") and decoded.signals:
            state = decoded.signals[0].value
            assert isinstance(state, int)
            self.lanes[channel, node].states.take(since_us, nmt_state_name(state))

    def follow(self, record: Record) -> None:
        """Decode a frame, count it, and add its events and values."""
        decoded = self._decoder.take(record)
        self.count(record)
        self.take(record, decoded)
        self.take_signals(record, decoded)

    def take_signals(self, record: Record, decoded: Decoded) -> None:
        """Add the values of a PDO, or of a message of a DBC file."""
        if not decoded.signals or not (decoded.kind == "dbc" or "pdo" in decoded.kind):
            return
        since_us = self.since(record.at_us)
        for signal in decoded.signals:
            name = SignalName(record.channel, decoded.node, decoded.kind, signal.name)
            self._take_signal(name, since_us, signal, decoded.source)

    def track(self, name: SignalName, unit: str, source: str) -> SignalTrack | None:
        """Return the track of a signal, or None if there are too many signals."""
        track = self.signals.get(name)
        if track is None:
            if len(self.signals) >= _MOST_SIGNALS:
                self.signals_left.add(name)
                return None
            states = _Bands() if name.name == "statusword" else None
            track = self.signals[name] = SignalTrack(unit, source, states=states)
        return track

    def end(self) -> None:
        """Process the end of the log. Heartbeats that were due by then are missing."""
        for row in self.rows():
            reported_us = row.heartbeats.last_us
            if reported_us is not None and row.is_late(self.last_us):
                self._gap(row.channel, row.node, reported_us, self.last_us)

    def _gap(self, channel: str, node: int, from_us: int, to_us: int) -> None:
        begin_us = self.since(from_us)
        text = f"no heartbeat for {(to_us - from_us) / 1e3:.0f} ms"
        gap = Mark(begin_us, text, max(0, self.since(to_us) - begin_us))
        self.lanes[channel, node].gaps.append(gap)

    def _take_command(self, channel: str, since_us: int, decoded: Decoded) -> None:
        for (bus, node), lane in self.lanes.items():
            if bus == channel and decoded.node in (None, node):
                lane.commands.append(Mark(since_us, f"NMT {decoded.text}"))
                row = self.row(channel, node)
                if row and row.state is None and row.commanded is not None:
                    lane.states.take(since_us, nmt_state_name(row.commanded))

    def _take_transfer(self, channel: str, node: int, transfer: Transfer) -> None:
        if not transfer.outcome.answered and self.row(channel, node) is None:
            return
        lane = self.lanes[channel, node]
        done = transfer.outcome is TransferOutcome.DONE and not transfer.flaws
        mark = Mark(self.since(transfer.at_us), str(transfer), transfer.duration_us)
        (lane.transfers if done else lane.failures).append(mark)

    def _take_signal(self, name: SignalName, since_us: int, signal: Signal, source: str) -> None:
        value = signal.value
        if not isinstance(value, int | float) or not isfinite(value):
            return
        track = self.track(name, signal.unit, source)
        if track is None:
            return
        if source == "dbc" and signal.text and track.states is None and not track.count:
            track.states = _Bands()  # an enumerated signal: its values have names
        track.take(1, float(value), float(value))
        if track.states is None:
            self.reach(since_us)
            self.values.spread_at(name, since_us // self.values.width_us, value, value)
        elif name.name == "statusword" and source != "dbc":
            track.states.take(since_us, drive_state(int(value)) or "?")
        else:
            track.states.take(since_us, signal.text or f"{value:g}")


# The frames around some moments, out of a log that is read a second time.


@dataclass(slots=True)
class _Excerpt:
    """The frames around one of the frames."""

    records: list[Record]
    wanted: int


def excerpts(
    pieces: Iterable[Sequence[Record]], numbers: Iterable[int], frames: int
) -> dict[int, _Frames]:
    """Return the frames around some chosen frames of a log, such as the frames of faults.

    Args:
        pieces: all frames of the log in order, divided into pieces of any length.
        numbers: positions of the chosen frames in the log, from 1.
        frames: number of frames to include before and after each chosen frame.

    Returns:
        A dictionary with one excerpt for each chosen frame. The key is the position of the chosen
        frame in the log. The value is the position where the excerpt begins in the log, and the
        frames of the excerpt.
    """
    order = deque(sorted(set(numbers)))
    found: dict[int, _Frames] = {}
    before: list[Record] = []
    running: list[_Excerpt] = []
    passed = 0
    for piece in pieces:
        size = len(piece)
        for one in running:
            one.records += piece[: one.wanted]
            one.wanted -= min(one.wanted, size)
        running = [one for one in running if one.wanted]
        while order and order[0] <= passed + size:
            number = order.popleft()
            row = number - 1 - passed
            begin, end = max(0, row - frames), row + frames + 1
            head = before[-(frames - row) :] if row < frames else []
            records = [*head, *piece[begin:end]]
            found[number] = passed + begin + 1 - len(head), records
            if end > size:
                running.append(_Excerpt(records, end - size))
        if not order and not running:
            break
        before = [*before, *piece[-frames:]][-frames:] if frames else []
        passed += size
    return found


_Frames = tuple[int, list[Record]]
