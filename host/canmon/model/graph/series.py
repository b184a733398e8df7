"""The samples of one signal.

>>> View(0, 1_000_000).zoomed(2, 250_000)
View(from_us=125000, to_us=625000, ranges={}, cursor_us=None, origin_us=0)
"""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from math import isfinite
from operator import le
from typing import TYPE_CHECKING

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.signal_spec import EXTENDED, CurveSpec, FrameSlice, ObjectName
from tickrig.wire.can import MAX_DATA_BYTES, ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.decode.decoder import Decoder


@dataclass(slots=True)
class Series:
    """A signal's values in the order of their times.

    Args:
        label: what people call it.
        axis: the vertical axis it is drawn on, from 1.
        unit: of the values, empty where unknown.
        most: how many samples are kept; when there are twice as many, the oldest go. 0 keeps all.

    Attributes:
        at_us: the times.
        values: as many values.
        not_numbers: how many values were NaN or infinite; they are left out.
    """

    label: str
    axis: int = 1
    unit: str = ""
    most: int = 0
    at_us: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    not_numbers: int = 0

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.at_us)

    def append(self, at_us: int, value: float) -> None:
        """Add a sample; one that is earlier than the last takes the time of the last."""
        if not isfinite(value):
            self.not_numbers += 1
            return
        if self.at_us and at_us < self.at_us[-1]:
            at_us = self.at_us[-1]
        self.at_us.append(at_us)
        self.values.append(value)
        if self.most and len(self.at_us) >= 2 * self.most:
            del self.at_us[: -self.most], self.values[: -self.most]

    def extend(self, at_us: bytes, values: bytes) -> None:
        """Add many samples: 64-bit numbers and doubles of this machine."""
        times, numbers = array("q", at_us), array("d", values)
        rises = not (times and self.at_us) or times[0] >= self.at_us[-1]
        if rises and all(map(isfinite, numbers)) and all(map(le, times, islice(times, 1, None))):
            self.at_us += times
            self.values += numbers
            return
        for time_us, value in zip(times, numbers, strict=True):
            self.append(time_us, value)

    def clear(self) -> None:
        """Forget the samples."""
        del self.at_us[:], self.values[:]

    def between(self, from_us: int, to_us: int) -> slice:
        """Return which samples lie in a span of time, both ends included."""
        return slice(bisect_left(self.at_us, from_us), bisect_right(self.at_us, to_us))

    def before(self, at_us: int) -> int | None:
        """Return the index of the latest sample at or before a time, None if there is none."""
        index = bisect_right(self.at_us, at_us) - 1
        return index if index >= 0 else None


LEAST_US = 10
"""No view is shorter."""


@dataclass(frozen=True, slots=True)
class View:
    """A span of time, and where wanted the ranges of vertical axes.

    Attributes:
        from_us: its beginning,
        to_us: its end, later.
        ranges: least and greatest value by axis; other axes fit what is seen.
        cursor_us: a moment that is marked.
        origin_us: the moment that is written as 0.
    """

    from_us: int
    to_us: int
    ranges: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    cursor_us: int | None = None
    origin_us: int = 0

    def __post_init__(self) -> None:
        """Raise ValueError unless the span and the ranges are not empty."""
        if self.to_us <= self.from_us:
            raise ValueError(f"a view from {self.from_us} us to {self.to_us} us shows nothing")
        for axis, (low, high) in self.ranges.items():
            if not low < high:
                raise ValueError(f"axis {axis} from {low:g} to {high:g} shows nothing")

    @classmethod
    def of(cls, series: Iterable[Series]) -> View:
        """Return the view in which all samples are seen; the first is its origin."""
        spans = [(one.at_us[0], one.at_us[-1]) for one in series if one.at_us]
        from_us = min((span[0] for span in spans), default=0)
        to_us = max([from_us + 1, *(span[1] for span in spans)])
        return cls(from_us, to_us, origin_us=from_us)

    @property
    def span_us(self) -> int:
        """How long it is."""
        return self.to_us - self.from_us

    def seconds(self, at_us: int) -> float:
        """Return a moment as it is written: in seconds since the origin."""
        return (at_us - self.origin_us) / 1e6

    def zoomed(self, factor: float, at_us: int | None = None) -> View:
        """Return it `factor` times closer; `at_us`, else the middle, stays where it is."""
        at_us = (self.from_us + self.to_us) // 2 if at_us is None else at_us
        span_us = max(LEAST_US, round(self.span_us / factor))
        from_us = at_us - (at_us - self.from_us) * span_us // self.span_us
        return replace(self, from_us=from_us, to_us=from_us + span_us)

    def moved(self, fraction: float) -> View:
        """Return it moved by a fraction of its span, later for a positive one."""
        by_us = round(self.span_us * fraction)
        return replace(self, from_us=self.from_us + by_us, to_us=self.to_us + by_us)


# Series out of what was heard.


class Collector:
    """Takes the values of some signals.

    A name that only begins an object's name takes the first object that fits, and keeps to it.

    Args:
        words: the signals.
        decoder: for objects; without one they have no values.
        most: as `Series.most`.

    Attributes:
        series: one for each word.
    """

    def __init__(
        self, words: Sequence[CurveSpec], decoder: Decoder | None = None, most: int = 0
    ) -> None:
        self.series = [Series(word.label or word.text, word.axis, most=most) for word in words]
        self._decoder = decoder
        self._slices: defaultdict[int, list[tuple[FrameSlice, Series]]] = defaultdict(list)
        self._objects: list[_Object] = []
        for word, series in zip(words, self.series, strict=True):
            if isinstance(word.source, FrameSlice):
                self._slices[word.source.key].append((word.source, series))
            else:
                self._objects.append(_Object(word, word.source, series))

    def join(self, other: Collector) -> None:
        """Take over the signals of another one, with their samples."""
        self.series += other.series
        self._objects += other._objects
        for key, pairs in other._slices.items():
            self._slices[key] += pairs

    def remove(self, number: int) -> None:
        """Forget a signal."""
        gone = self.series.pop(number)
        for pairs in self._slices.values():
            pairs[:] = [pair for pair in pairs if pair[1] is not gone]
        self._objects = [wanted for wanted in self._objects if wanted.series is not gone]

    def take(self, record: Record) -> None:
        """Take the values in a frame."""
        wanted = self._objects and self._decoder
        self.take_decoded(record, wanted.take(record) if wanted else None)

    def take_decoded(self, record: Record, decoded: Decoded | None) -> None:
        """Take the values in a frame that somebody has decoded, or whose objects nobody wants."""
        at_us, _, frame, _ = record
        if not isinstance(frame, ErrorFrame) and not frame.remote:
            key = frame.can_id | EXTENDED if frame.extended else frame.can_id
            for cut, series in self._slices.get(key, ()):
                value = cut.value(frame.data)
                if value is not None:
                    series.append(at_us, value)
        if decoded is not None and decoded.signals:
            for wanted in self._objects:
                wanted.take(at_us, decoded)

    def take_all(self, records: Iterable[Record]) -> None:
        """Take the values in frames."""
        for record in records:
            self.take(record)

    def take_columns(self, columns: Columns) -> None:
        """Take the values of slices in a block of a log."""
        for key, pairs in self._slices.items():
            chosen = columns.ident == key
            for cut, series in pairs:
                if cut.data_bytes > MAX_DATA_BYTES:
                    continue  # columns hold classic frames
                whole = chosen & (columns.dlc >= cut.data_bytes)
                values = cut.values(columns.payload[whole])
                series.extend(columns.at_us[whole].tobytes(), values.tobytes())


class _Object:
    """An object that is waited for."""

    def __init__(self, word: CurveSpec, wanted: ObjectName, series: Series) -> None:
        self._word, self._wanted, self.series = word, wanted, series
        self._found: tuple[int | None, str] | None = None

    def take(self, at_us: int, decoded: Decoded) -> None:
        """Take its value, if it is among the signals."""
        if self._wanted.node not in (None, decoded.node):
            return
        for signal in decoded.signals:
            place = decoded.node, signal.name
            if self._found is None and signal.name.lower().startswith(self._wanted.name):
                self._find(place, signal.unit)
            if place == self._found and (value := self._wanted.value(signal)) is not None:
                self.series.append(at_us, value)

    def _find(self, place: tuple[int | None, str], unit: str) -> None:
        """Keep to the first that fits, and call the curve so."""
        self._found = place
        if self._wanted.bit is None:
            self.series.unit = unit
        if not self._word.label:
            node, name = place
            begun = self._word.text.lower().rfind(self._wanted.name)
            bit = self._word.text[begun + len(self._wanted.name) :]
            self.series.label = f"{'' if node is None else f'{node}.'}{name}{bit}"
