"""The signals of a PDO, by its mapping."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from tickrig.host.monitor.decode.decoded import Decoded, Signal
from tickrig.host.monitor.decode.drive_state import drive_state
from tickrig.host.monitor.decode.objects.object_text import ObjectText
from tickrig.host.monitor.decode.sdo.transfer import write_entry
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.pdo import DAM_MPDO, SAM_MPDO, MappedObject, Mpdo
from tickrig.wire.errors import WireError

MPDO: Final = (SAM_MPDO, DAM_MPDO)
DUMMIES: Final = range(0x0020)
UNMAPPED: Final = "unmapped"

Write = Callable[[int], str]
Convert = Callable[[int], Value]


class Field(NamedTuple):
    """Where a signal is and how it is read.

    Attributes:
        name: of the signal.
        shift: its lowest bit.
        mask: of its bits, moved down.
        sign: its sign bit, 0 if it has none.
        convert: makes the value of the number, None where that is the value.
        unit: as `Signal.unit`.
        write: makes the text, None where that is the value.
    """

    name: str
    shift: int
    mask: int
    sign: int = 0
    convert: Convert | None = None
    unit: str = ""
    write: Write | None = None


class PdoLayout:
    """Decodes the frames of one PDO.

    Args:
        pdo: kind, node and source, as of `Decoded`.
        fields: its signals; none where the mapping is not known.
        bits: how many are mapped.
        note: what people must know of the mapping.
    """

    def __init__(
        self, pdo: tuple[str, int, str], fields: Sequence[Field] = (), bits: int = 0, note: str = ""
    ) -> None:
        self.kind, self.node, self.source = pdo
        self._fields, self._size, self._note = tuple(fields), (bits + 7) // 8, note

    def decode(self, at_us: int, frame: CanFrame) -> Decoded:
        """Return the signals of a frame."""
        data = frame.data
        if frame.remote:
            return Decoded(self.kind, self.node, "asked for by RTR", (), self.source)
        if len(data) < self._size:
            text = f"{len(data)} B, {self._size} are mapped: not processed"
            return Decoded(self.kind, self.node, text, (), self.source)
        number = int.from_bytes(data, "little")
        signals = []
        for name, shift, mask, sign, convert, unit, write in self._fields:
            raw = number >> shift & mask
            value: Value = (raw ^ sign) - sign if convert is None else convert(raw)
            signals.append(Signal(name, value, unit, "" if write is None else write(raw)))
        said = " ".join([*map(str, signals), self._note]) if self._note else None
        return Decoded(self.kind, self.node, said, tuple(signals), self.source)


class MpdoLayout:
    """Decodes multiplexed PDOs: each frame names its object.

    Args:
        pdo: kind, node and source, as of `Decoded`.
        describe: tells the objects of the node.
    """

    def __init__(
        self, pdo: tuple[str, int, str], describe: Callable[[int, int], ObjectText]
    ) -> None:
        self.kind, self.node, self.source = pdo
        self._describe = describe

    def decode(self, at_us: int, frame: CanFrame) -> Decoded:
        """Return the object in a frame."""
        try:
            mpdo = Mpdo.parse(frame.data)
        except WireError as error:
            return Decoded(self.kind, self.node, str(error), (), self.source)
        text = self._describe(mpdo.index, mpdo.sub)
        data = mpdo.data[: text.kind.size] if text.kind and text.kind.size else mpdo.data
        value, written = text.read(data)
        name = text.name or write_entry((mpdo.index, mpdo.sub))
        way = f"to {mpdo.node_id or 'all'}" if mpdo.destination else f"from {mpdo.node_id}"
        signals = (Signal(name, value, text.unit, written),)
        return Decoded(self.kind, self.node, f"{signals[0]} {way}", signals, self.source)


def make_field(mapped: MappedObject, shift: int, text: ObjectText) -> Field:
    """Return how a mapped object is read; a type of another size than mapped is not used."""
    name = text.name or write_entry((mapped.index, mapped.sub))
    kind = text.kind if text.kind and _fits(text.kind, mapped.bits) else None
    field = Field(name, shift, (1 << mapped.bits) - 1, unit=text.unit)
    digits = (mapped.bits + 3) // 4

    def in_hex(raw: int) -> str:
        return f"0x{raw:0{digits}X}"

    if kind is None:
        return field._replace(write=in_hex)
    if name == "statusword":
        return field._replace(write=write_statusword)
    if text.in_hex or name == "controlword":
        return field._replace(write=in_hex)
    sign = 1 << mapped.bits - 1 if kind.signed else 0
    if not kind.is_integer:
        return field._replace(convert=_converter(kind, text))
    if text.factor != 1:
        return field._replace(convert=lambda raw: ((raw ^ sign) - sign) * text.factor)
    return field._replace(sign=sign)


def write_statusword(raw: int) -> str:
    """Write a statusword with its state."""
    return f"0x{raw:04X}[{drive_state(raw) or '?'}]"


def _fits(kind: DataType, bits: int) -> bool:
    return kind.bits == bits or (kind.is_integer and not kind.signed and bits <= kind.bits)


def _converter(kind: DataType, text: ObjectText) -> Convert:
    def convert(raw: int) -> Value:
        value = kind.decode(raw.to_bytes(kind.size, "little"))
        return value * text.factor if isinstance(value, float) else value

    return convert
