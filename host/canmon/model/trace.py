"""The latest frames as a list, with the times between them."""

from __future__ import annotations

from collections import deque
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model.decode.filter import Filter
from tickrig.host.canmon.model.frames import ERROR, Record, any_ident
from tickrig.wire.can import ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.frames import AnyRecord


_LINE: Final = 1 << 32
"""Flag of a line of a serial port in a key. Adding 1 marks lines to the device."""

_CAPACITY: Final = 100_000

_Key = tuple[str, int]
"""Bus and identifier."""


class TraceRow(NamedTuple):
    """A row of a trace: one frame, or one message of a serial line.

    Attributes:
        number: number of the row since the trace began, from 0.
        record: frame of the row.
        since_us: time since the previous frame on any bus in microseconds, or None for the first
            frame.
        gap_us: time since the previous frame with the same CAN-ID on the same bus in microseconds,
            or None for the first such frame.
        changed: bits in which the payload differs from that of the previous frame with this CAN-ID;
            see `BitRow`.
        decoded: decoded meaning of the frame, or None if it was not decoded.
    """

    number: int
    record: AnyRecord
    since_us: int | None
    gap_us: int | None
    changed: int = 0
    decoded: Decoded | None = None


class Ring:
    """Buffer of trace rows with a fixed capacity.

    If the buffer is full, a new row replaces the oldest one.

    Args:
        capacity: number of rows that are kept.

    Attributes:
        count: number of all rows that were added, which is also the number of the next row.
    """

    def __init__(self, capacity: int = _CAPACITY) -> None:
        self._rows: deque[TraceRow] = deque(maxlen=capacity)
        self.count = 0

    @property
    def first(self) -> int:
        """The number of the oldest row that is kept."""
        return self.count - len(self._rows)

    def append(self, row: TraceRow) -> None:
        """Add a row at the end."""
        self._rows.append(row)
        self.count += 1

    def rows(self, begin: int, count: int) -> list[TraceRow]:
        """Return rows by number. Dropped and future rows are left out."""
        first = min(max(begin, self.first), self.count)
        end = min(max(begin + count, first), self.count)
        if first - self.first < self.count - end:
            return list(islice(self._rows, first - self.first, end - self.first))
        found = islice(reversed(self._rows), self.count - end, self.count - first)
        return list(found)[::-1]  # the latest are near this end

    def tail(self, count: int) -> list[TraceRow]:
        """Return the latest rows."""
        return self.rows(self.count - count, count)

    def copy(self) -> Ring:
        """Return a copy to which no further rows are added."""
        found = Ring(self._rows.maxlen or _CAPACITY)
        found._rows.extend(self._rows)
        found.count = self.count
        return found

    def clear(self) -> None:
        """Delete all rows."""
        self._rows.clear()
        self.count = 0


class FrameTrace(Ring):
    """Buffer of the latest frames, as rows with the time since the previous frame.

    If the time of a frame is earlier than that of the previous frame, the time between them is 0.

    Args:
        capacity: number of frames to keep. Older frames are removed.

    Attributes:
        origin_us: time of the first frame, from which displayed times count, or None before the
            first frame.
    """

    def __init__(self, capacity: int = _CAPACITY) -> None:
        super().__init__(capacity)
        self.origin_us: int | None = None
        self._latest: dict[_Key, tuple[int, int]] = {}
        self._last_us: int | None = None

    def take(self, record: AnyRecord, decoded: Decoded | None = None) -> TraceRow:
        """Add a frame or a line at the end."""
        at_us, key = record.at_us, _key_of(record)
        data = record.frame.data if isinstance(record, Record) else record.data
        payload = int.from_bytes(data, "little")
        before_us, before = self._latest.get(key, (None, payload))
        row = TraceRow(
            self.count,
            record,
            _since(at_us, self._last_us),
            _since(at_us, before_us),
            payload ^ before,
            decoded,
        )
        self.append(row)
        self._latest[key] = at_us, payload
        self._last_us = at_us
        if self.origin_us is None:
            self.origin_us = at_us
        return row

    def clear(self) -> None:
        """Delete all frames."""
        super().clear()
        self._latest.clear()
        self._last_us = self.origin_us = None


def _key_of(record: AnyRecord) -> _Key:
    """Return bus and identifier. Error frames have a key of their own, and so have lines."""
    if not isinstance(record, Record):
        return record.channel, _LINE + record.sent
    frame = record.frame
    return record.channel, ERROR if isinstance(frame, ErrorFrame) else any_ident(frame)


def _since(at_us: int, before_us: int | None) -> int | None:
    return None if before_us is None else max(0, at_us - before_us)


class Latest(NamedTuple):
    """The latest frame with one CAN-ID on one bus that passed a display filter.

    Attributes:
        row: row of this frame.
        frames: number of frames with the CAN-ID that passed.
    """

    row: TraceRow
    frames: int


class DisplayFilter:
    """The rows of a trace that pass a filter. The rows are updated as the trace grows.

    Args:
        trace: trace that supplies the rows. Rows that it already holds are filtered, too.
        wanted: function that returns whether a row passes, or None for all rows.

    Attributes:
        passed: rows that passed, or the trace itself if all rows pass.
    """

    def __init__(self, trace: FrameTrace, wanted: Filter | None = None) -> None:
        self._trace, self.wanted = trace, wanted
        self.passed: Ring = trace if wanted is None else Ring()
        self._latest: dict[_Key, Latest] = {}
        self._seen = 0
        self.follow()

    def follow(self) -> None:
        """Process the new rows of the trace."""
        wanted = self.wanted
        for row in self._trace.rows(self._seen, self._trace.count - self._seen):
            decoded = row.decoded
            if wanted is not None:
                if decoded is None or not wanted.matches(row.record, decoded):
                    continue
                self.passed.append(row)
            key = _key_of(row.record)
            before = self._latest.get(key)
            self._latest[key] = Latest(row, 1 if before is None else before.frames + 1)
        self._seen = self._trace.count

    def latest(self) -> list[Latest]:
        """Return the latest row of each identifier, by bus and identifier."""
        return [self._latest[key] for key in sorted(self._latest)]

    def clear(self) -> None:
        """Restart with an empty trace."""
        self._trace.clear()
        self.passed.clear()
        self._latest.clear()
        self._seen = 0
