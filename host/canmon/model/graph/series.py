r"""The samples of one signal.

>>> View(0, 1_000_000).zoomed(2, 250_000)
View(from_us=125000, to_us=625000, ranges={}, cursor_us=None, origin_us=0)

>>> parse_signal("speed=181[2:6]s*0.001@2").label
'speed'
>>> parse_signal("3.statusword.fault").source
ObjectName(node=3, name='statusword', bit=3)

>>> position = parse_slice("181[2:6]s*0.001")
>>> position.value(bytes.fromhex("3702 0000feff 0000"))
-131.072
>>> parse_slice("181[0.4+2]").value(b"\x30")
3.0
"""

from __future__ import annotations

import re
import struct
from array import array
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from math import isfinite
from operator import le
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.node_memory import BITS, drive_state
from tickrig.host.canmon.model.decode.services import nmt_state_name
from tickrig.host.canmon.model.frames import EXTENDED, Record, Stamp
from tickrig.host.canmon.model.traffic import NO_RATES, BitRates
from tickrig.wire.can import MAX_DATA_BYTES, ErrorFrame, FdFrame, frame_bits
from tickrig.wire.canopen.emcy import describe
from tickrig.wire.canopen.nmt import NmtState

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.decode.decoder import Decoder


# What people write to name a curve: `speed=3.velocity_actual_value@2`, `181[2:6]s*0.001`.


_FORM: Final = (
    "ID[BYTES]TYPE*FACTOR+OFFSET, as 181[2:6]s*0.001: BYTES is 2, 2:6, bit 2.3 or bits 2.3+5;"
    " TYPE is u, s or f, and b behind it for big-endian"
)
_NUMBER: Final = r"(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?"
_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})"
    r"\[([0-9]{1,2})(?::([0-9]{1,2})|\.([0-7])(?:\+([0-9]{1,2}))?)?\]"
    rf"([usf]?)(b?)(?:([*/])(-?{_NUMBER}))?([+-]{_NUMBER})?",
    re.ASCII,
)
_MOST_BITS: Final = 64
_FRAME_BITS: Final = 8 * 64
_FLOATS: Final = {32: "f", 64: "d"}


@dataclass(frozen=True, slots=True)
class FrameSlice:
    """A value that is defined by the position of its bits in a frame, such as `181[2:6]s*0.001`.

    Attributes:
        can_id: CAN-ID of the frames, without flags.
        extended: whether the CAN-ID has 29 bits.
        first_bit: number of the lowest bit in the data, from 0 to 511, or 63 for classic CAN. Bit 0
            is the lowest bit of byte 0.
        bits: number of bits, from 1 to 64.
        kind: type of the number: `u` for unsigned, `s` for signed, `f` for float.
        big_endian: whether the first byte is the most significant one. This is allowed only for
            whole bytes.
        factor: factor by which the number is multiplied.
        offset: offset that is added after the multiplication.
    """

    can_id: int
    extended: bool
    first_bit: int
    bits: int
    kind: str = "u"
    big_endian: bool = False
    factor: float = 1.0
    offset: float = 0.0

    @property
    def key(self) -> int:
        """The identifier. Bit 31 is set for an extended identifier."""
        return self.can_id | (EXTENDED if self.extended else 0)

    @property
    def data_bytes(self) -> int:
        """The number of bytes that a frame must have to contain the slice."""
        return (self.first_bit + self.bits + 7) // 8

    def value(self, data: bytes) -> float | None:
        """Return the value in a frame, or None if the frame is too short to contain it.

        Args:
            data: data bytes of the frame.
        """
        if len(data) < self.data_bytes:
            return None
        return self._number(data) * self.factor + self.offset

    def values(self, payload: NDArray[np.uint64]) -> NDArray[np.float64]:
        """Return the values in many frames at once, as a numpy array.

        Args:
            payload: eight data bytes of each frame as a little-endian number.
        """
        import numpy as np  # noqa: PLC0415 - an extra

        drop = np.uint64(64 - self.bits)
        raw = payload << np.uint64(64 - self.first_bit - self.bits)
        if self.big_endian:
            raw = (raw >> drop).byteswap()
        numbers: NDArray[np.generic]
        if self.kind == "s":
            numbers = raw.view(np.int64) >> np.int64(64 - self.bits)
        elif self.kind == "f":
            size = self.bits // 8
            numbers = (raw >> drop).astype(f"u{size}").view(f"f{size}")
        else:
            numbers = raw >> drop
        with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
            return numbers.astype(np.float64) * self.factor + self.offset

    def _number(self, data: bytes) -> float:
        if not self.big_endian and self.kind != "f":
            number = int.from_bytes(data, "little") >> self.first_bit & (1 << self.bits) - 1
            negative = self.kind == "s" and number >> self.bits - 1
            return number - (1 << self.bits) if negative else number
        piece = data[self.first_bit // 8 : self.data_bytes]
        if self.kind == "f":
            order = ">" if self.big_endian else "<"
            value: float = struct.unpack(order + _FLOATS[self.bits], piece)[0]
            return value
        return int.from_bytes(piece, "big", signed=self.kind == "s")


def parse_slice(text: str) -> FrameSlice:
    """Parse the notation for bits of a frame, such as `181[2:6]s*0.001`.

    Args:
        text: CAN-ID, position in brackets, and optionally type, byte order, factor and offset.

    Raises:
        ValueError: the text has another form, or names bits that no frame has.
    """
    match = _NOTATION.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not {_FORM}")
    can_id, byte, end, bit, bits, kind, big, sign, factor, offset = match.groups()
    first_bit = int(byte) * 8 + int(bit or 0)
    width = _width(text, first_bit, end, bit, bits)
    if kind == "f" and (width not in _FLOATS or first_bit % 8):
        raise ValueError(f"{text!r} has {width} bits; a float has 4 or 8 whole bytes")
    if big and bit:
        raise ValueError(f"{text!r}: big-endian takes whole bytes")
    scale = float(factor or 1)
    if not scale:
        raise ValueError(f"{text!r} has the factor 0")
    return FrameSlice(
        _can_id(can_id),
        len(can_id) == 8,
        first_bit,
        width,
        kind or "u",
        bool(big),
        1 / scale if sign == "/" else scale,
        float(offset or 0),
    )


def _can_id(digits: str) -> int:
    most = 0x1FFF_FFFF if len(digits) == 8 else 0x7FF
    if (can_id := int(digits, 16)) > most:
        raise ValueError(f"CAN-ID 0x{digits} is above 0x{most:X}")
    return can_id


def _width(text: str, first_bit: int, end: str | None, bit: str | None, bits: str | None) -> int:
    width = 8
    if end:
        width = int(end) * 8 - first_bit
    elif bit:
        width = int(bits or 1)
    if not 1 <= width <= _MOST_BITS or first_bit + width > _FRAME_BITS:
        raise ValueError(
            f"{text!r} has {width} bits from bit {first_bit}; a signal has 1 to {_MOST_BITS}"
            f" of the {_FRAME_BITS} that a frame has, in classic CAN of 64"
        )
    return width


_WORD: Final = re.compile(r"(?:([^=\[\]@]+)=)?([^=@]+)(?:@([1-9]))?")
_OBJECT: Final = re.compile(
    r"(?:([0-9]{1,3})\.)?([a-z_][a-z0-9_.]*|[0-9a-f]{4}h[0-9a-f:]*)", re.ASCII | re.IGNORECASE
)


@dataclass(frozen=True, slots=True)
class ObjectName:
    """Name of an object whose value is drawn as a curve, or of one bit of its value.

    Attributes:
        node: node-ID, or None for any node and for signals of a DBC file.
        name: name of the object as in decoded frames, or the beginning of that name, in lower case.
        bit: number of the bit, from 0, or None for the whole value.
    """

    node: int | None
    name: str
    bit: int | None = None

    def value(self, signal: Signal) -> float | None:
        """Return the number to draw: the value of a signal, or the wanted bit of it.

        The result is None if the signal is not a number.

        Args:
            signal: signal of a decoded frame.
        """
        value = signal.value
        if not isinstance(value, int | float):
            return None
        if self.bit is None:
            return value
        return int(value) >> self.bit & 1


@dataclass(frozen=True, slots=True)
class _BusSignal:
    """A signal of a bus or node that is not the value of an object.

    Attributes:
        kind: kind of the signal, a key of `BUS_SIGNALS`.
        node: node-ID, or None for any node.
    """

    kind: str
    node: int | None = None


LOAD, NMT, EMCY, SDO, SYNC_JITTER = "load", "nmt", "emcy", "sdo", "sync jitter"
BUS_SIGNALS: Final = {
    LOAD: "load of the bus, in tenths of a second",
    NMT: "NMT state, as a node tells it",
    EMCY: "error, until it is reset",
    SDO: "duration of SDO transfers",
    SYNC_JITTER: "difference of each SYNC period from the one before",
}
"""Words for signals that are not in the data of frames, with their descriptions."""

OF_NODES: Final = (NMT, EMCY, SDO)
"""Signals that each node has."""

_BUS_SIGNAL: Final = re.compile(
    r"(?:([0-9]{1,3})\.)?(nmt|emcy|sdo)|load|sync[ ._-]jitter", re.ASCII
)


@dataclass(frozen=True, slots=True)
class CurveSpec:
    """A curve that the user has requested, such as `speed=181[2:6]s*0.001@2`.

    Attributes:
        label: label before the `=`, empty if there is none.
        source: bits of a frame, object of a node, or other signal from which the values are taken.
        axis: number of the vertical axis after the `@`, 1 if there is none.
        text: text of the signal, without label and axis.
    """

    label: str
    source: FrameSlice | ObjectName | _BusSignal
    axis: int
    text: str


def parse_signal(text: str) -> CurveSpec:
    """Parse the request for a curve, which has the form `[LABEL=]SIGNAL[@AXIS]`.

    `LABEL` is the displayed name of the curve. `AXIS` is the number of the vertical axis, 1 by
    default. `SIGNAL` is one of these:

    - Bits of a frame, for example `181[2:6]s*0.001`.
    - An object, for example `3.position`.
    - One of `BUS_SIGNALS`, for example `load` or `3.nmt`.

    Args:
        text: text of the request.

    Raises:
        ValueError: the text has another form.
    """
    match = _WORD.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not [LABEL=]SIGNAL[@AXIS], as speed=181[2:6]s*0.001@2")
    label, signal, axis = match.groups()
    source = parse_slice(signal) if "[" in signal else _object(signal)
    return CurveSpec(label or "", source, int(axis or 1), signal)


def _object(text: str) -> ObjectName | _BusSignal:
    told = _BUS_SIGNAL.fullmatch(text.lower())
    if told is not None and 1 <= int(told[1] or 1) <= 127:
        kind = told[2] or (LOAD if told[0] == LOAD else SYNC_JITTER)
        return _BusSignal(kind, int(told[1]) if told[1] else None)
    match = _OBJECT.fullmatch(text)
    if match is None or not 1 <= int(match[1] or 1) <= 127:
        raise ValueError(f"{text!r} is neither an object, as 3.position, nor a slice, as 181[2:6]s")
    node, name = int(match[1]) if match[1] else None, match[2].lower()
    base, _, bit = name.rpartition(".")
    shift = BITS.get(base, {}).get(bit)
    return ObjectName(node, name) if shift is None else ObjectName(node, base, shift)


@dataclass(slots=True)
class Series:
    """The samples of one signal in the order of their times, which a graph draws.

    Args:
        label: displayed name of the signal.
        axis: number of the vertical axis that the signal belongs to, from 1.
        unit: unit of the values, empty if unknown.
        most: number of latest samples to keep, or 0 to keep all. Older samples are removed when
            there are twice as many.

    Attributes:
        at_us: times of the samples in microseconds.
        values: values of the samples.
        not_numbers: number of values that were ignored because they were NaN or infinite.
        names: name of each value if the values are states, such as NMT states, or None if they are
            numbers.
    """

    label: str
    axis: int = 1
    unit: str = ""
    most: int = 0
    at_us: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    not_numbers: int = 0
    names: dict[float, str] | None = None

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.at_us)

    def append(self, at_us: int, value: float) -> None:
        """Add a sample. A value that is NaN or infinite is not added, but counted.

        If the time is before that of the previous sample, the time of the previous sample is used.

        Args:
            at_us: time of the sample in microseconds.
            value: value of the sample.
        """
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
        """Add many samples as 64-bit numbers and doubles of this machine."""
        times, numbers = array("q", at_us), array("d", values)
        rises = not (times and self.at_us) or times[0] >= self.at_us[-1]
        if rises and all(map(isfinite, numbers)) and all(map(le, times, islice(times, 1, None))):
            self.at_us += times
            self.values += numbers
            return
        for time_us, value in zip(times, numbers, strict=True):
            self.append(time_us, value)

    def append_state(self, at_us: int, value: float, name: str) -> None:
        """Add a value, and the name of the state that the value stands for.

        If the value does not stand for a state, the name is empty.
        """
        if name:
            self.names = self.names or {}
            self.names[value] = name
        self.append(at_us, value)

    def name(self, value: float) -> str:
        """Return the name of a state, empty for a number."""
        return "" if self.names is None else self.names.get(value, f"{value:g}")

    def clear(self) -> None:
        """Delete the samples."""
        del self.at_us[:], self.values[:]

    def between(self, from_us: int, to_us: int) -> slice:
        """Return the samples in a span of time that includes both ends."""
        return slice(bisect_left(self.at_us, from_us), bisect_right(self.at_us, to_us))

    def before(self, at_us: int) -> int | None:
        """Return the index of the last sample at or before a time, or None if there is none.

        Args:
            at_us: time in microseconds.
        """
        index = bisect_right(self.at_us, at_us) - 1
        return index if index >= 0 else None


LEAST_US = 10
"""Duration of the shortest view."""


@dataclass(frozen=True, slots=True)
class View:
    """The part of a graph that is visible: a time span, and optionally ranges of the vertical axes.

    Attributes:
        from_us: start of the time span in microseconds.
        to_us: end of the time span in microseconds, after its start.
        ranges: least and greatest visible value on an axis, by number of the axis. Axes without a
            range fit the visible values.
        cursor_us: time of the cursor in microseconds, or None if there is no cursor.
        origin_us: time in microseconds that is written as 0.
        stamp: format in which times are written: since the origin, in seconds since the epoch, or
            as dates.
    """

    from_us: int
    to_us: int
    ranges: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    cursor_us: int | None = None
    origin_us: int = 0
    stamp: Stamp = field(default=Stamp.ZERO, repr=False)

    def __post_init__(self) -> None:
        """Raise ValueError unless the span and the ranges are not empty."""
        if self.to_us <= self.from_us:
            raise ValueError(f"a view from {self.from_us} us to {self.to_us} us shows nothing")
        for axis, (low, high) in self.ranges.items():
            if not low < high:
                raise ValueError(f"axis {axis} from {low:g} to {high:g} shows nothing")

    @classmethod
    def of(cls, series: Iterable[Series]) -> View:
        """Return the view that contains all samples. The first sample is its origin."""
        spans = [(one.at_us[0], one.at_us[-1]) for one in series if one.at_us]
        from_us = min((span[0] for span in spans), default=0)
        to_us = max([from_us + 1, *(span[1] for span in spans)])
        return cls(from_us, to_us, origin_us=from_us)

    @property
    def span_us(self) -> int:
        """The duration of the view."""
        return self.to_us - self.from_us

    def seconds(self, at_us: int) -> float:
        """Return a moment in seconds since the origin, as it is displayed."""
        return (at_us - self.origin_us) / 1e6

    def zoomed(self, factor: float, at_us: int | None = None) -> View:
        """Return a view with another time span, zoomed around a moment that keeps its position.

        Args:
            factor: zoom factor. A factor above 1 zooms in, a factor below 1 zooms out.
            at_us: moment that keeps its position, in microseconds, or None for the middle of the
                view.
        """
        at_us = (self.from_us + self.to_us) // 2 if at_us is None else at_us
        span_us = max(LEAST_US, round(self.span_us / factor))
        from_us = at_us - (at_us - self.from_us) * span_us // self.span_us
        return replace(self, from_us=from_us, to_us=from_us + span_us)

    def moved(self, fraction: float) -> View:
        """Return the view moved along the time axis.

        Args:
            fraction: distance as a fraction of the time span. A positive fraction moves to later
                times.
        """
        by_us = round(self.span_us * fraction)
        return replace(self, from_us=self.from_us + by_us, to_us=self.to_us + by_us)


# Series from traffic.


class Collector:
    """Collector that takes the values of some signals from frames, for a graph.

    If the name of a signal is only the beginning of an object's name, it selects the first object
    in the traffic that matches.

    Args:
        words: signals to collect.
        decoder: decoder that finds the values of objects, or None if only bits of frames are
            collected.
        most: number of latest samples to keep of each signal, or 0 to keep all.
        rates: bit rates of the bus, from which the bus load is calculated.
        each_node: whether a signal that names no node gets one series for each node that sends it.

    Attributes:
        series: samples of each signal.
        object_names: names of all objects seen in the traffic while the object of a signal was not
            found yet.
        first_us: time of the first frame in microseconds, or None if no frame has arrived.
    """

    def __init__(
        self,
        words: Sequence[CurveSpec],
        decoder: Decoder | None = None,
        most: int = 0,
        rates: BitRates = NO_RATES,
        *,
        each_node: bool = False,
    ) -> None:
        self.series = [Series(word.label or word.text, word.axis, most=most) for word in words]
        self.object_names: dict[str, None] = {}
        self.first_us: int | None = None
        self._decoder, self._each_node, self._rates = decoder, each_node, rates
        self._slices: defaultdict[int, list[tuple[FrameSlice, Series]]] = defaultdict(list)
        self._objects: list[_Object] = []
        self._samplers: list[_Sampler] = []
        for word, series in zip(words, self.series, strict=True):
            match word.source:
                case FrameSlice():
                    self._slices[word.source.key].append((word.source, series))
                case _BusSignal():
                    self._samplers.append(_Sampler(word, word.source, series, rates))
                case _:
                    self._objects.append(_Object(word, word.source, series, self.object_names))

    @property
    def missing(self) -> list[str]:
        """The objects that did not occur, as the user wrote them."""
        return [one.word.text for one in self._objects if one.found is None]

    def join(self, other: Collector) -> None:
        """Add the signals and the samples of another collector."""
        self.series += other.series
        self._objects += other._objects
        self._samplers += other._samplers
        for key, pairs in other._slices.items():
            self._slices[key] += pairs

    def remove(self, number: int) -> None:
        """Remove a signal."""
        gone = self.series.pop(number)
        for pairs in self._slices.values():
            pairs[:] = [pair for pair in pairs if pair[1] is not gone]
        self._objects = [wanted for wanted in self._objects if wanted.series is not gone]
        self._samplers = [wanted for wanted in self._samplers if wanted.series is not gone]

    def take(self, record: Record) -> None:
        """Add the values in a frame."""
        wanted = (self._objects or self._samplers) and self._decoder
        self.take_decoded(record, wanted.take(record) if wanted else None)

    def take_decoded(self, record: Record, decoded: Decoded | None) -> None:
        """Add the values in a frame that the caller has already decoded.

        Args:
            record: frame, with its bus and time.
            decoded: meaning of the frame, or None if the frame contains none of the requested
                objects.
        """
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
        for sampler in self._samplers:
            fresh = sampler.take(record, decoded)
            if fresh is not None and self._each_node:
                self._sample(sampler, fresh, record, decoded)

    def _sample(self, beside: _Sampler, node: int, record: Record, decoded: Decoded | None) -> None:
        """Begin a series for one more node with a signal of any node."""
        kind = beside.wanted.kind
        if any((one.wanted.kind, one.node) == (kind, node) for one in self._samplers):
            return
        wanted = _BusSignal(kind, node)
        series = Series("", beside.word.axis, most=beside.series.most)
        sampler = _Sampler(replace(beside.word, source=wanted), wanted, series, self._rates)
        sampler.take(record, decoded)
        self.series.append(series)
        self._samplers.append(sampler)

    def take_all(self, records: Iterable[Record]) -> None:
        """Add the values in frames."""
        for record in records:
            if self.first_us is None:
                self.first_us = record.at_us
            self.take(record)

    def take_columns(self, columns: Columns) -> None:
        """Add the values of slices in a block of frames."""
        if self.first_us is None and len(columns):
            self.first_us = int(columns.at_us[0])
        for key, pairs in self._slices.items():
            chosen = columns.ident == key
            for cut, series in pairs:
                if cut.data_bytes > MAX_DATA_BYTES:
                    continue  # columns hold classic frames
                whole = chosen & (columns.dlc >= cut.data_bytes)
                values = cut.values(columns.payload[whole])
                series.extend(columns.at_us[whole].tobytes(), values.tobytes())


_LOAD_US: Final = 100_000
_NO_ERROR: Final = range(0x0000, 0x0100)


class _Sampler:
    """Collector of a signal of a bus or a node that is not in the data of a frame.

    Args:
        word: text of the signal.
        wanted: requested signal. A signal of any node belongs to the first node that has the
            signal.
        series: series for the values.
        rates: bit rates of the bus.
    """

    def __init__(
        self, word: CurveSpec, wanted: _BusSignal, series: Series, rates: BitRates
    ) -> None:
        self.word, self.wanted, self.series, self.node = word, wanted, series, wanted.node
        self._rates, self._channel = rates, ""
        self._begin_us, self._bits = -1, 0
        self._sync_us, self._gap_us = -1, -1
        series.unit = {SDO: "ms", SYNC_JITTER: "ms"}.get(wanted.kind, "")
        if wanted.kind == LOAD:
            series.unit = "kbit/s" if rates.nominal is None else "%"
        if wanted.kind in (NMT, EMCY):
            series.names = {}
        if wanted.node is not None and not word.label:
            series.label = f"{wanted.node}.{wanted.kind}"

    def take(self, record: Record, decoded: Decoded | None) -> int | None:
        """Add the value in a frame to the samples, if the frame contains the signal.

        A signal without a node-ID is bound to the first node that sends it. If another node sends
        it later, return the node-ID of the other node, so that the caller can begin a series for
        it. Otherwise, return None.

        Args:
            record: frame, with its bus and time.
            decoded: meaning of the frame, or None if it was not decoded.
        """
        if self.wanted.kind == LOAD:
            self._load(record)
        elif decoded is None:
            return None
        elif self.wanted.kind == SYNC_JITTER:
            if decoded.kind == "sync":
                self._sync(record)
        elif decoded.node is not None and (values := self._values(decoded)):
            if self.node is None:
                self.node = decoded.node
                self.series.label = self.word.label or f"{self.node}.{self.wanted.kind}"
            if decoded.node != self.node:
                return decoded.node if self.wanted.node is None else None
            for value, name in values:
                self.series.append_state(record.at_us, value, name)
        return None

    def _values(self, decoded: Decoded) -> list[tuple[float, str]]:
        """Return the values in a frame for the signal, each with its name if it has one."""
        kind, told = decoded.kind, decoded.signals[0].value if decoded.signals else None
        match self.wanted.kind:
            case "sdo":
                return [(one.duration_us / 1e3, "") for one in decoded.transfers]
            case "nmt" if kind == "boot-up":
                return [(NmtState.PRE_OPERATIONAL, nmt_state_name(NmtState.PRE_OPERATIONAL))]
            case "nmt" if kind in ("heartbeat", "guard") and isinstance(told, int):
                return [(told, nmt_state_name(told))]
            case "emcy" if kind == "emcy" and isinstance(told, int):
                name = "no error" if told in _NO_ERROR else f"{told:04X}h {describe(told)}"
                return [(told, name)]
            case _:
                return []

    def _load(self, record: Record) -> None:
        """Count the bits of a frame. The value of a window is added when the window is over."""
        at_us, channel, frame, _ = record
        if self._begin_us < 0:
            self._begin_us, self._channel = at_us, channel
        if channel != self._channel or isinstance(frame, ErrorFrame):
            return
        windows = (at_us - self._begin_us) // _LOAD_US
        if windows > 0:
            self.series.append(self._begin_us + _LOAD_US, self._per_window())
            self._bits = 0
            if windows > 1:  # silence begins and ends with a 0
                self.series.append(self._begin_us + 2 * _LOAD_US, 0)
                self.series.append(self._begin_us + windows * _LOAD_US, 0)
            self._begin_us += windows * _LOAD_US
        self._bits += self._rates.bits(frame) if isinstance(frame, FdFrame) else frame_bits(frame)

    def _per_window(self) -> float:
        bits_s = self._bits * 1e6 / _LOAD_US
        return bits_s / 1e3 if not self._rates.nominal else bits_s * 100 / self._rates.nominal

    def _sync(self, record: Record) -> None:
        at_us, channel = record.at_us, record.channel
        if self._sync_us < 0:
            self._sync_us, self._channel = at_us, channel
        elif channel == self._channel:
            gap_us = at_us - self._sync_us
            if self._gap_us >= 0:
                self.series.append(at_us, abs(gap_us - self._gap_us) / 1e3)
            self._sync_us, self._gap_us = at_us, gap_us


_STATUSWORD: Final = "statusword"


class _Object:
    """A requested object of a node."""

    def __init__(
        self, word: CurveSpec, wanted: ObjectName, series: Series, known: dict[str, None]
    ) -> None:
        self.word, self._wanted, self.series = word, wanted, series
        self._known = known
        self.found: tuple[int | None, str] | None = None
        self._is_state = False

    def take(self, at_us: int, decoded: Decoded) -> None:
        """Add the value of the requested object to the samples, if the frame contains it.

        Args:
            at_us: time of the frame in microseconds.
            decoded: meaning of the frame.
        """
        if self.found is None:
            self._look(decoded)
        if self.found is None or decoded.node != self.found[0]:
            return
        name = self.found[1]
        for signal in decoded.signals:
            if signal.name == name and (value := self._wanted.value(signal)) is not None:
                is_named = self._is_state and signal.text
                state = (drive_state(int(value)) or signal.text) if is_named else ""
                self.series.append_state(at_us, value, state)

    def _look(self, decoded: Decoded) -> None:
        """Keep the names in a frame, and find the object if the frame contains it."""
        if len(self._known) < _MOST_HEARD:
            self._known |= dict.fromkeys(_named(decoded.node, one.name) for one in decoded.signals)
        if self._wanted.node not in (None, decoded.node):
            return
        for signal in decoded.signals:
            if signal.name.lower().startswith(self._wanted.name):
                self._find((decoded.node, signal.name), signal.unit)
                return

    def _find(self, place: tuple[int | None, str], unit: str) -> None:
        """Keep the first object that fits, and use its name for the curve."""
        self.found = place
        self._is_state = self._wanted.bit is None and place[1] == _STATUSWORD
        if self._wanted.bit is None:
            self.series.unit = unit
        if not self.word.label:
            begun = self.word.text.lower().rfind(self._wanted.name)
            bit = self.word.text[begun + len(self._wanted.name) :]
            self.series.label = _named(*place) + bit


_MOST_HEARD: Final = 2_000
"""Number of names that are kept to suggest one after a misspelt name."""


def _named(node: int | None, name: str) -> str:
    return f"{'' if node is None else f'{node}.'}{name}"
