r"""What people write to name a curve: `speed=3.velocity_actual_value@2`, `181[2:6]s*0.001`.

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
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.decode.decoded import Signal
from tickrig.host.canmon.model.decode.object_text import BITS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

EXTENDED: Final = 1 << 31
"""In a key: a 29-bit identifier."""

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
    """Which bits of which frame, and what they count.

    Attributes:
        can_id: identifier of the frame.
        extended: a 29-bit identifier.
        first_bit: 0..511, in classic CAN to 63; bit 0 is the lowest of byte 0.
        bits: 1..64.
        kind: `u` unsigned, `s` signed, `f` float.
        big_endian: the first byte is the highest; whole bytes only.
        factor: the value is the number times this,
        offset: plus this.
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
        """The identifier, bit 31 set for an extended one."""
        return self.can_id | (EXTENDED if self.extended else 0)

    @property
    def data_bytes(self) -> int:
        """How many bytes a frame must have to hold it."""
        return (self.first_bit + self.bits + 7) // 8

    def value(self, data: bytes) -> float | None:
        """Return the value in a frame's data, None where the frame is too short."""
        if len(data) < self.data_bytes:
            return None
        return self._number(data) * self.factor + self.offset

    def values(self, payload: NDArray[np.uint64]) -> NDArray[np.float64]:
        """Return the values in many payloads of eight bytes, each one little-endian number."""
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
    """Read a slice.

    Raises:
        ValueError: not a slice, or bits that no frame has.
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
    """An object of a node, or one bit of it.

    Attributes:
        node: node-ID, None for any: a signal of a DBC file has none.
        name: as the decoder names it, or how that begins; in lower case.
        bit: which bit, None for the whole value.
    """

    node: int | None
    name: str
    bit: int | None = None

    def value(self, signal: Signal) -> float | None:
        """Return the number of a signal, None where it is no number."""
        value = signal.value
        if not isinstance(value, int | float):
            return None
        if self.bit is None:
            return value
        return int(value) >> self.bit & 1


@dataclass(frozen=True, slots=True)
class CurveSpec:
    """A curve that is asked for.

    Attributes:
        label: what it is called; empty where the text did not say.
        source: what it is taken from.
        axis: its vertical axis, from 1.
        text: the signal as it was written.
    """

    label: str
    source: FrameSlice | ObjectName
    axis: int
    text: str


def parse_signal(text: str) -> CurveSpec:
    """Read `[LABEL=]SIGNAL[@AXIS]`: a slice as 181[2:6]s*0.001, or an object as 3.position.

    Raises:
        ValueError: not a signal.
    """
    match = _WORD.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not [LABEL=]SIGNAL[@AXIS], as speed=181[2:6]s*0.001@2")
    label, signal, axis = match.groups()
    source = parse_slice(signal) if "[" in signal else _object(signal)
    return CurveSpec(label or "", source, int(axis or 1), signal)


def _object(text: str) -> ObjectName:
    match = _OBJECT.fullmatch(text)
    if match is None or not 1 <= int(match[1] or 1) <= 127:
        raise ValueError(f"{text!r} is neither an object, as 3.position, nor a slice, as 181[2:6]s")
    node, name = int(match[1]) if match[1] else None, match[2].lower()
    base, _, bit = name.rpartition(".")
    shift = BITS.get(base, {}).get(bit)
    return ObjectName(node, name) if shift is None else ObjectName(node, base, shift)
