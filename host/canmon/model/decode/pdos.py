"""PDOs, with their CAN-IDs, their nodes, and the meaning of their bits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal, write_entry
from tickrig.host.canmon.model.decode.node_memory import (
    STATUSWORD,
    NodeMemory,
    ObjectText,
    drive_state,
)
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.nmt import CAN_ID_MASK, EXTENDED, INVALID
from tickrig.wire.canopen.pdo import DAM_MPDO, MAX_MAPPED_OBJECTS, SAM_MPDO, MappedObject, Mpdo
from tickrig.wire.errors import WireError

MPDO: Final = (SAM_MPDO, DAM_MPDO)
_MPDO_BYTES: Final = 8
DUMMIES: Final = range(0x0020)
UNMAPPED: Final = "unmapped"

_Write = Callable[[int], str]
_Convert = Callable[[int], Value]


class Field(NamedTuple):
    """Position of a signal in the data of a PDO, and the conversion of its bits to a value.

    The data are read as a little-endian number.

    Attributes:
        name: name of the signal.
        shift: number of the signal's lowest bit in the data.
        mask: mask with a 1 for each bit of the signal, starting at bit 0.
        sign: mask of the sign bit, or 0 if the signal is unsigned.
        convert: function that converts the number to the value, or None if no conversion is needed.
        unit: unit of the value, as in `Signal.unit`.
        write: function that returns the value as text, or None if the plain value is shown.
    """

    name: str
    shift: int
    mask: int
    sign: int = 0
    convert: _Convert | None = None
    unit: str = ""
    write: _Write | None = None


class PdoDecoder:
    """Decoder for the frames of one PDO, made from its mapping.

    Args:
        pdo: kind, node and source of the decoded frames, as in `Decoded`.
        fields: signals that are mapped to the PDO, empty if the mapping is unknown.
        bits: number of mapped bits.
        note: remark about the mapping that is shown with each frame, or empty.

    Attributes:
        size: number of data bytes according to the mapping.
    """

    def __init__(
        self, pdo: tuple[str, int, str], fields: Sequence[Field] = (), bits: int = 0, note: str = ""
    ) -> None:
        self.kind, self.node, self.source = pdo
        self.fields, self.size, self.note = tuple(fields), (bits + 7) // 8, note
        self._wanted = None if note else self.size

    def decode(self, at_us: int, frame: CanFrame) -> Decoded:
        """Return the signals of a frame."""
        data = frame.data
        if frame.remote:
            return Decoded(self.kind, self.node, "asked for by RTR", (), self.source)
        if len(data) < self.size:
            text = f"{len(data)} B, {self.size} are mapped: not processed"
            return Decoded(self.kind, self.node, text, (), self.source, size=self._wanted)
        number = int.from_bytes(data, "little")
        signals = []
        for name, shift, mask, sign, convert, unit, write in self.fields:
            raw = number >> shift & mask
            # Two's complement without a branch: `sign` is 0 for a type without one.
            value: Value = (raw ^ sign) - sign if convert is None else convert(raw)
            signals.append(Signal(name, value, unit, "" if write is None else write(raw)))
        said = " ".join([*map(str, signals), self.note]) if self.note else None
        kind, node, told = self.kind, self.node, self._wanted
        return Decoded(kind, node, said, tuple(signals), self.source, size=told)


class _MpdoLayout:
    """Decoder of multiplexed PDOs, in which each frame names its object.

    Args:
        pdo: kind, node and source as in `Decoded`.
        describe: function that returns the descriptions of the node's objects.
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
            return Decoded(self.kind, self.node, str(error), (), self.source, size=_MPDO_BYTES)
        text = self._describe(mpdo.index, mpdo.sub)
        data = mpdo.data[: text.kind.size] if text.kind and text.kind.size else mpdo.data
        value, written = text.read(data)
        name = text.name or write_entry((mpdo.index, mpdo.sub))
        way = f"to {mpdo.node_id or 'all'}" if mpdo.destination else f"from {mpdo.node_id}"
        signals = (Signal(name, value, text.unit, written),)
        said = f"{signals[0]} {way}"
        return Decoded(self.kind, self.node, said, signals, self.source, size=_MPDO_BYTES)


def _make_field(mapped: MappedObject, shift: int, text: ObjectText) -> Field:
    """Return the field of a mapped object.

    A data type whose size differs from the mapping is not used.
    """
    name = text.name or write_entry((mapped.index, mapped.sub))
    kind = text.kind if text.kind and _fits(text.kind, mapped.bits) else None
    field = Field(name, shift, (1 << mapped.bits) - 1, unit=text.unit)
    digits = (mapped.bits + 3) // 4

    def in_hex(raw: int) -> str:
        return f"0x{raw:0{digits}X}"

    if kind is None:
        return field._replace(write=in_hex)
    if name == "statusword":
        return field._replace(write=_write_statusword)
    if text.in_hex or name == "controlword":
        return field._replace(write=in_hex)
    sign = 1 << mapped.bits - 1 if kind.signed else 0
    if not kind.is_integer:
        return field._replace(convert=_converter(kind, text))
    if text.factor != 1:
        return field._replace(convert=lambda raw: ((raw ^ sign) - sign) * text.factor)
    return field._replace(sign=sign)


def _write_statusword(raw: int) -> str:
    """Return a statusword and its state as text."""
    return f"0x{raw:04X}[{drive_state(raw) or '?'}]"


def _fits(kind: DataType, bits: int) -> bool:
    return kind.bits == bits or (kind.is_integer and not kind.signed and bits <= kind.bits)


def _converter(kind: DataType, text: ObjectText) -> _Convert:
    def convert(raw: int) -> Value:
        value = kind.decode(raw.to_bytes(kind.size, "little"))
        return value * text.factor if isinstance(value, float) else value

    return convert


PDOS: Final = 512
_PREDEFINED: Final = 4
"""Number of PDOs per direction that have a CAN-ID in the pre-defined connection set."""
PDO_OBJECTS: Final = range(0x1400, 0x1C00)

_DIRECTIONS: Final = {False: ("tpdo", 0x1800, 0x180), True: ("rpdo", 0x1400, 0x200)}
"""Name, communication parameter and pre-defined CAN-ID of PDO 1, by whether the node receives."""

_Layout = PdoDecoder | _MpdoLayout


class NodePdo(NamedTuple):
    """Identification of one PDO of one node.

    When sorted, PDOs that nodes send (TPDOs) precede PDOs that nodes receive (RPDOs).
    """

    receives: bool
    node: int
    number: int

    @property
    def kind(self) -> str:
        """Kind as in `Decoded.kind`."""
        return f"{_DIRECTIONS[self.receives][0]}{self.number}"

    @property
    def parameter(self) -> int:
        """The index of the PDO's communication parameter."""
        return _DIRECTIONS[self.receives][1] + self.number - 1

    @property
    def mapping(self) -> int:
        """The index of the PDO's mapping."""
        return self.parameter + 0x200


class PdoTable:
    """PDOs by CAN-ID, as far as EDS files and traffic define them."""

    def __init__(self) -> None:
        self._by_can_id: dict[int, dict[NodePdo, _Layout]] = {}
        self._can_ids: dict[NodePdo, int] = {}

    def layout(self, can_id: int) -> _Layout | None:
        """Return the mapping of the PDO with a CAN-ID, or None if no PDO has this CAN-ID.

        If one node sends a PDO with this CAN-ID and others receive it, the mapping of the sender is
        returned.

        Args:
            can_id: CAN-ID with 11 bits.
        """
        claims = self._by_can_id.get(can_id)
        # `NodePdo` sorts those that are sent first, so a TPDO names the fields of a shared
        # CAN-ID.
        return claims[min(claims)] if claims else None

    def update(self, pdo: NodePdo, memory: NodeMemory) -> set[int]:
        """Update the CAN-ID and mapping of a PDO after an object of its node has changed.

        Args:
            pdo: PDO to update.
            memory: known objects of the node.

        Returns:
            CAN-IDs whose meaning may have changed.
        """
        before = self._can_ids.pop(pdo, None)
        if before is not None:
            del self._by_can_id[before][pdo]
        can_id, layout = can_id_of(pdo, memory), _layout(pdo, memory)
        if can_id is None or layout is None:
            return set() if before is None else {before}
        self._can_ids[pdo] = can_id
        self._by_can_id.setdefault(can_id, {})[pdo] = layout
        return {can_id} if before is None else {can_id, before}

    def known(self, node: int) -> tuple[NodePdo, ...]:
        """Return the PDOs of a node that have a CAN-ID."""
        return tuple(pdo for pdo in self._can_ids if pdo.node == node)


def _pdo_of(node: int, index: int) -> NodePdo:
    """Return the PDO to which an object 1400h to 1BFFh belongs."""
    return NodePdo(index < 0x1800, node, index % PDOS + 1)


def pdos_of(node: int, indices: Iterable[int]) -> set[NodePdo]:
    """Return the PDOs that objects with these indices configure."""
    return {_pdo_of(node, index) for index in indices if index in PDO_OBJECTS}


def can_id_of(pdo: NodePdo, memory: NodeMemory) -> int | None:
    """Return the CAN-ID of a PDO, or None if the PDO is not valid or its CAN-ID is unknown.

    The CAN-ID is in the COB-ID of the PDO. If the COB-ID is unknown, the CAN-ID of the PDOs 1 to 4
    is that of the pre-defined connection set. The CAN-ID of the other PDOs is then unknown. A
    CAN-ID of 29 bits also gives None.

    Args:
        pdo: PDO to look up.
        memory: known objects of its node.
    """
    cob_id = memory.number(pdo.parameter, 1)
    if cob_id is not None:
        return None if cob_id & (INVALID | EXTENDED) else cob_id & CAN_ID_MASK
    if pdo.number > _PREDEFINED:
        return None
    return _DIRECTIONS[pdo.receives][2] + 0x100 * (pdo.number - 1) + pdo.node


def _layout(pdo: NodePdo, memory: NodeMemory) -> _Layout | None:
    mapping = pdo.mapping
    count, source = memory.number(mapping, 0), memory.source(mapping)
    if count is None:
        source = memory.source(pdo.parameter)
        note = f"{UNMAPPED}: {mapping:04X}h is unknown"
        return PdoDecoder((pdo.kind, pdo.node, source), note=note) if source else None
    if count in MPDO:
        return _MpdoLayout((pdo.kind, pdo.node, source), memory.describe)
    entries = mapped_objects(memory, mapping, min(count, MAX_MAPPED_OBJECTS))
    if (STATUSWORD, 16) in {((item.index, item.sub), item.bits) for item in entries}:
        memory.has_statusword = True
    missing = f"and {mapping:04X}h:{len(entries) + 1:02X}, which is unknown"
    note = missing if len(entries) < count else ""
    bits = sum(item.bits for item in entries)
    fields = _fields(memory, entries)
    return PdoDecoder((pdo.kind, pdo.node, source), fields, bits, note)


def mapped_objects(memory: NodeMemory, mapping: int, count: int) -> list[MappedObject]:
    """Return the mapped objects up to the first unknown one."""
    entries = []
    for sub in range(1, count + 1):
        value = memory.number(mapping, sub)
        if value is None:
            break
        entries.append(MappedObject.parse(value))
    return entries


def _fields(memory: NodeMemory, entries: list[MappedObject]) -> list[Field]:
    fields, shift = [], 0
    for item in entries:
        if item.index not in DUMMIES:
            text = memory.describe(item.index, item.sub)
            fields.append(_make_field(item, shift, text))
        shift += item.bits
    return fields
