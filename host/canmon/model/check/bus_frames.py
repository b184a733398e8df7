"""The frames of a log as arrays, one set for each bus. Rules that need all frames use them."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import FD, Record, flagged_id, frame_of
from tickrig.wire.can import MAX_DATA_BYTES, STANDARD_MAX, CanFrame, ErrorFrame, FdFrame

if TYPE_CHECKING:
    import numpy as np

    from tickrig.host.canmon.model.columns import columns as column_frames
    from tickrig.host.canmon.model.columns.columns import Columns
else:  # an extra
    np = LazyModule("numpy")
    column_frames = LazyModule("tickrig.host.canmon.model.columns.columns")

_MANY: Final = 50_000
"""The number of frames from which importing numpy pays off."""

_SPIKE_FRAMES: Final = 3


class FramePlace(NamedTuple):
    """The number and time of a frame in a log.

    A fault has such a pair for each frame that shows the fault.

    Attributes:
        number: position of the frame in the log. The first frame has number 1.
        at_us: time of the frame in microseconds.
    """

    number: int
    at_us: int


class Hit(NamedTuple):
    """A violation of a rule on one bus.

    At the end of the diagnosis, all violations of one rule by one node are reported together as one
    fault. If no single node is responsible, this applies to all violations of one rule with one
    CAN-ID.

    Attributes:
        rule: name of the violated rule.
        node: node-ID of the node that violated the rule, or None if no single node did.
        ident: CAN-ID of the violation with its flags, as in `BusFrames.ident`, or None if the
            violation concerns the whole bus.
        text: description of the violation.
        rows: indices in `BusFrames` of the frames that show the violation, at least one.
        amount: number of violations in these frames.
    """

    rule: str
    node: int | None
    ident: int | None
    text: str
    rows: tuple[int, ...]
    amount: int = 1


class BusFrames:
    """All frames of one bus in the order of the log, stored as one array for each property.

    The index of a frame in these arrays is called its row.

    Attributes:
        name: name of the bus.
        at_us: times of the frames in microseconds, exactly as in the log.
        ident: CAN-IDs with their flags, as `any_ident` returns them. An error frame has the flag
            `ERROR` and its error class.
        dlc: number of data bytes of each frame. For a remote frame, it is the requested number.
        payload: first 8 data bytes of each frame as a little-endian number.
        number: position of each frame in the log. The first frame has number 1.
        sent: value 1 for each frame that the recorder itself sent, otherwise 0.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.at_us, self.ident, self.dlc = array("q"), array("Q"), array("B")
        self.sent = array("B")
        self.payload, self.number = array("Q"), array("q")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.at_us)

    def add(self, record: Record, number: int) -> None:
        """Append a frame."""
        frame = record.frame
        data = frame.data
        self.at_us.append(record.at_us)
        self.ident.append(flagged_id(record) | (FD if isinstance(frame, FdFrame) else 0))
        self.dlc.append(frame.dlc if isinstance(frame, CanFrame) else len(data))
        self.payload.append(int.from_bytes(data[:MAX_DATA_BYTES], "little"))
        self.number.append(number)
        self.sent.append(record.sent)

    def extend(self, frames: Columns, numbers: Any) -> None:
        """Append a block of frames.

        Args:
            frames: frames to append.
            numbers: array with the position of each of these frames in the log, from 1.
        """
        self.at_us.frombytes(frames.at_us.astype("<i8").tobytes())
        self.ident.frombytes(frames.ident.astype("<u8").tobytes())
        self.dlc.frombytes(frames.dlc.tobytes())
        self.payload.frombytes(frames.payload.astype("<u8").tobytes())
        self.number.frombytes(numbers.astype("<i8").tobytes())
        self.sent.frombytes(frames.sent.tobytes())

    def frame(self, row: int) -> CanFrame | ErrorFrame:
        """Return a classic frame or an error frame."""
        return frame_of(self.ident[row], self.dlc[row], self.payload[row])

    def place(self, row: int) -> FramePlace:
        """Return the position and time of a frame in the log."""
        return FramePlace(self.number[row], self.at_us[row])

    def rows_by_ident(self) -> dict[int, Sequence[int]]:
        """Return the rows of each identifier, in the order of the log."""
        if not self.is_large:
            rows: dict[int, list[int]] = {}
            for row, ident in enumerate(self.ident):
                rows.setdefault(ident, []).append(row)
            return dict(rows)
        idents = np.frombuffer(self.ident, np.uint64)
        # Most identifiers are their own number: sorting 64 bits is slow, 16 bits are not.
        long = np.flatnonzero(idents > STANDARD_MAX)
        others, places = np.unique(idents[long], return_inverse=True)
        many = len(others) + STANDARD_MAX + 1 > 1 << 16
        small = idents.astype(np.uint32 if many else np.uint16)
        small[long] = places.reshape(-1) + STANDARD_MAX + 1
        order, counts = np.argsort(small, kind="stable"), np.bincount(small)
        found = np.flatnonzero(counts)
        ends = np.cumsum(counts[found]).tolist()
        begins = [0, *ends[:-1]]
        names = np.concatenate((np.arange(STANDARD_MAX + 1, dtype=np.uint64), others))[found]
        parts: Any = zip(names.tolist(), begins, ends, strict=True)
        runs: Any = order  # an array is a sequence for all that is done with rows
        return {ident: runs[begin:end] for ident, begin, end in parts}

    @property
    def is_large(self) -> bool:
        """Whether rows are arrays of numpy."""
        return len(self) >= _MANY and find_spec("numpy") is not None

    def picked(self, column: array[int], rows: Sequence[int]) -> Sequence[int]:
        """Return the values of some frames from one of the arrays, such as `at_us`.

        `rows` contains the indices of the frames. If `rows` is a numpy array, the values are
        returned as a numpy array, otherwise as a list.
        """
        if isinstance(rows, list | tuple | range):
            return [column[row] for row in rows]
        kinds = {"q": np.int64, "Q": np.uint64, "B": np.uint8}
        found: Any = np.frombuffer(column, kinds[column.typecode])[rows]
        return found  # type: ignore[no-any-return]

    def latest(self, times: array[int], begin: int = 0) -> int:
        """Return the latest of the times from the row `begin` on."""
        if self.is_large:
            return int(np.frombuffer(times, np.int64)[begin:].max())
        return max(times[begin:])

    def backward(self) -> list[int]:
        """Return the rows whose time is before the time of the previous row."""
        if self.is_large:
            times = np.frombuffer(self.at_us, np.int64)
            backward: list[int] = (np.flatnonzero(times[1:] < times[:-1]) + 1).tolist()
            return backward
        return [row for row, (a, b) in enumerate(pairwise(self.at_us), 1) if b < a]


def steady_times(bus: BusFrames, backward: Sequence[int]) -> tuple[array[int], list[int]]:
    """Return the corrected times of a bus, and the rows at which the clock was set back.

    If only a few successive frames are out of order, each of them gets the time of a neighbouring
    frame. If the clock of the recorder was set back, the times after this moment stay as recorded.

    Args:
        bus: frames of the bus.
        backward: rows whose time is before the time of the previous row.
    """
    times = bus.at_us
    if not backward:
        return times, []
    times, cuts = array("q", times), []
    for row in backward:
        if times[row] >= times[row - 1]:
            continue
        if row >= 2 and times[row] >= times[row - 2]:  # the one before was too late
            times[row - 1] = times[row]
            continue
        later = next(
            (
                at
                for at in range(row + 1, min(row + 1 + _SPIKE_FRAMES, len(times)))
                if times[at] >= times[row - 1]
            ),
            None,
        )
        if later is None and row + _SPIKE_FRAMES < len(times):
            cuts.append(row)
            continue
        for at in range(row, len(times) if later is None else later):
            times[at] = times[row - 1]
    return times, cuts


class FrameKeeper:
    """Storage for all frames of a source, separated by bus, for rules that need the whole log.

    Attributes:
        buses: frames of each bus, by name.
        frames: number of frames stored so far, on all buses.
    """

    def __init__(self) -> None:
        self.buses: dict[str, BusFrames] = {}
        self.frames = 0

    def take(self, frames: Columns | Iterable[Record]) -> None:
        """Store frames, given as a block of columns or as records."""
        if not isinstance(frames, list | tuple) and isinstance(frames, column_frames.Columns):
            self._extend(frames)
            return
        for record in frames:
            self.frames += 1
            bus = self.buses.get(record.channel)
            if bus is None:
                bus = self.buses[record.channel] = BusFrames(record.channel)
            bus.add(record, self.frames)

    def _extend(self, columns: Columns) -> None:
        if not len(columns):
            return
        for channel, rows, frames in column_frames.by_channel(columns):
            bus = self.buses.setdefault(channel, BusFrames(channel))
            bus.extend(frames, rows + (self.frames + 1))
        self.frames += len(columns)

    def around(self, number: int, frames: int) -> tuple[int, list[Record]]:
        """Return a frame of the log together with some frames before and after it.

        Args:
            number: position of the frame in the log. The first frame has number 1.
            frames: number of frames to return before the frame, and also after it. The caller must
                make sure that none of these is a CAN FD frame, because only 8 data bytes of each
                frame are stored.

        Returns:
            The position in the log of the first returned frame, and the frames in the order of the
            log.
        """
        first, found = max(1, number - frames), list[tuple[int, Record]]()
        for bus in self.buses.values():
            begin = bisect_left(bus.number, first)
            for row in range(begin, bisect_right(bus.number, number + frames)):
                frame, sent = bus.frame(row), bool(bus.sent[row])
                record = Record(bus.at_us[row], bus.name, frame, sent)
                found.append((bus.number[row], record))
        return first, [record for _, record in sorted(found, key=lambda one: one[0])]

    def __iter__(self) -> Iterator[BusFrames]:
        """Return the buses by name."""
        return (bus for _, bus in sorted(self.buses.items()))
