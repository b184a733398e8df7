"""Series out of what was heard."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.graph.series import Series
from tickrig.host.canmon.model.graph.signal_spec import EXTENDED, FrameSlice, ObjectName, SignalSpec
from tickrig.wire.can import MAX_DATA_BYTES
from tickrig.wire.can_error import ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.decode.decoder import Decoder


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
        self, words: Sequence[SignalSpec], decoder: Decoder | None = None, most: int = 0
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

    def __init__(self, word: SignalSpec, wanted: ObjectName, series: Series) -> None:
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
