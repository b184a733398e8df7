"""Series out of what was heard."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tickrig.host.monitor.decode.decoded import Signal
from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.graph.frame_slice import EXTENDED, FrameSlice
from tickrig.host.monitor.graph.series import Series
from tickrig.host.monitor.graph.signal_word import ObjectName, SignalWord
from tickrig.host.monitor.heard import Heard
from tickrig.wire.can_error import ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.monitor.logs.columns import Columns


class Collector:
    """Takes the values of some signals.

    A name that only begins an object's name takes the first object that fits, and keeps to it.

    Args:
        words: the signals.
        decoder: for objects.
        most: as `Series.most`.

    Attributes:
        series: one for each word.
    """

    def __init__(
        self, words: Sequence[SignalWord], decoder: Decoder | None = None, most: int = 0
    ) -> None:
        self.series = [Series(word.label or word.text, word.axis, most=most) for word in words]
        self._decoder = decoder or Decoder()
        self._slices: defaultdict[int, list[tuple[FrameSlice, Series]]] = defaultdict(list)
        self._objects: defaultdict[int, list[_Object]] = defaultdict(list)
        for word, series in zip(words, self.series, strict=True):
            if isinstance(word.source, FrameSlice):
                self._slices[word.source.key].append((word.source, series))
            else:
                named = bool(word.label)
                self._objects[word.source.node].append(_Object(word.source, series, named))

    def take(self, heard: Heard) -> None:
        """Take the values in a frame."""
        at_us, _, frame, _ = heard
        if not isinstance(frame, ErrorFrame) and not frame.remote:
            key = frame.can_id | EXTENDED if frame.extended else frame.can_id
            for cut, series in self._slices.get(key, ()):
                value = cut.value(frame.data)
                if value is not None:
                    series.append(at_us, value)
        if self._objects:
            decoded = self._decoder.take(heard)
            if decoded.signals and decoded.node is not None:
                for wanted in self._objects.get(decoded.node, ()):
                    for signal in decoded.signals:
                        wanted.take(at_us, signal)

    def take_columns(self, columns: Columns) -> None:
        """Take the values of slices in a whole log at once."""
        for key, pairs in self._slices.items():
            chosen = columns.ident == key
            for cut, series in pairs:
                whole = chosen & (columns.dlc >= cut.data_bytes)
                values = cut.values(columns.payload[whole])
                series.extend(columns.at_us[whole].tobytes(), values.tobytes())


class _Object:
    """An object that is waited for."""

    def __init__(self, wanted: ObjectName, series: Series, named: bool) -> None:
        self._wanted, self._series, self._named = wanted, series, named
        self._name = ""

    def take(self, at_us: int, signal: Signal) -> None:
        """Take its value, if that is what the signal is."""
        name = signal.name
        if name != self._name and not self._is_first(name):
            return
        value = self._wanted.value(signal)
        if value is not None:
            self._series.append(at_us, value)
            self._series.unit = signal.unit

    def _is_first(self, name: str) -> bool:
        if self._name or not name.startswith(self._wanted.name):
            return False
        self._name = name
        if not self._named:
            self._series.label = self._series.label.replace(self._wanted.name, name, 1)
        return True
