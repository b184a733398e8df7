"""PDO codec: mapping entries, values packed as bits, MPDOs (CiA 301, PDO).

>>> MappedObject.parse(0x6200_0108)
MappedObject(index=25088, sub=1, bits=8)
>>> [(mapped.index, shift) for mapped, shift in fields((0x6040_0010, 0x607A_0020))]
[(24640, 0), (24698, 16)]
>>> pack_bits(((1, 1), (0, 1), (5, 3))).hex()
'15'
>>> unpack_bits(bytes.fromhex("15"), (1, 1, 3))
(1, 0, 5)
>>> Mpdo.parse(bytes.fromhex("8500200134120000")).data.hex()
'34120000'
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.wire.canopen.nmt import CAN_ID_MASK, INVALID
from tickrig.wire.errors import FieldError, FramingError

MAX_PDO_BYTES: Final = 8
MAX_PDO_BITS: Final = 64
MAX_MAPPED_OBJECTS: Final = 64

SAM_MPDO: Final = 0xFE
"""Value of sub-index 0 of a mapping for a multiplexed PDO in source address mode."""

DAM_MPDO: Final = 0xFF
"""Value of sub-index 0 of a mapping for a multiplexed PDO in destination address mode."""

MPDO_DATA_BYTES: Final = 4

_DESTINATION: Final = 0x80
_NODE_ID_MASK: Final = 0x7F


@dataclass(frozen=True, slots=True)
class MappedObject:
    """An object that is mapped into a PDO (CiA 301, PDO mapping parameter).

    Attributes:
        index: index of the object, 0x0000..0xFFFF. An index below 0x0020 is a data type: the entry
            is a dummy, which only fills bits.
        sub: sub-index of the object, 0..255.
        bits: number of bits in the PDO.
    """

    index: int
    sub: int
    bits: int

    @classmethod
    def parse(cls, value: int) -> MappedObject:
        """Read the 32 bits of an entry."""
        # 6040 00 10h: index, sub-index, length in bits.
        return cls(value >> 16 & 0xFFFF, value >> 8 & 0xFF, value & 0xFF)

    def encode(self) -> int:
        """Return the 32 bits of an entry."""
        return self.index << 16 | self.sub << 8 | self.bits


def fields(mapping: Iterable[int]) -> Iterator[tuple[MappedObject, int]]:
    """Yield each object of a PDO mapping, with the number of bits that precede it in the PDO.

    Args:
        mapping: entries of the mapping parameter. For example, 6040 0010h is the object 6040h:00
            with 16 bits.
    """
    shift = 0
    for value in mapping:
        mapped = MappedObject.parse(value)
        yield mapped, shift
        shift += mapped.bits


@mypyc_attr(allow_interpreted_subclasses=True)
@dataclass(frozen=True, slots=True)
class PdoDescription:
    """Description of a PDO: its communication parameter and its mapping.

    Attributes:
        cob_id: COB-ID with its flags. Bit 31 is set if the PDO is off.
        mapping: mapped objects in the form 6040 0010h: index, sub-index, number of bits.
        transmission_type: transmission type, 0..255.
        inhibit_100us: inhibit time of a TPDO, in units of 100 us.
        event_ms: event timer, in ms.
        relative: whether the node-ID is added to the COB-ID.
    """

    cob_id: int
    mapping: tuple[int, ...] = ()
    transmission_type: int = 255
    inhibit_100us: int = 0
    event_ms: int = 0
    relative: bool = True

    @property
    def can_id(self) -> int:
        """The CAN-ID of the PDO, or 0 if it has none."""
        return self.cob_id & CAN_ID_MASK

    @property
    def enabled(self) -> bool:
        """Whether the PDO exists: bit 31 is 0."""
        return not self.cob_id & INVALID

    @property
    def size(self) -> int:
        """The length of the PDO in bytes."""
        return (sum(value & 0xFF for value in self.mapping) + 7) // 8


@dataclass(frozen=True, slots=True)
class Scanned:
    """An entry of an object scanner list (from 1FA0h on). It names an object to send by MPDO.

    The node sends an MPDO in source address mode (SAM) when the object changes. See CiA 301, object
    scanner list.

    Attributes:
        index: index of the object.
        sub: first sub-index of the object.
        block: number of consecutive sub-indices.
    """

    index: int
    sub: int
    block: int

    @classmethod
    def parse(cls, value: int) -> Scanned:
        """Read the 32 bits of an entry."""
        # bb iiii ss: block size, index, first sub-index.
        return cls(value >> 8 & 0xFFFF, value & 0xFF, value >> 24 & 0xFF)

    def encode(self) -> int:
        """Return the 32 bits of an entry."""
        return self.block << 24 | self.index << 8 | self.sub


@dataclass(frozen=True, slots=True)
class Dispatched:
    """An entry of an object dispatching list (from 1FD0h on), for data from another node.

    The other node (the producer) sends the value of one of its objects by MPDO in source address
    mode (SAM). This node (the consumer) stores the value in one of its own objects. The entry
    assigns the producer's object to the consumer's object. See CiA 301, object dispatching list.

    Attributes:
        node_id: node-ID of the producer.
        producer_index: index of the object in the producer.
        producer_sub: first sub-index of the object in the producer.
        index: index of the object in the consumer.
        sub: first sub-index of the object in the consumer.
        block: number of consecutive sub-indices.
    """

    node_id: int
    producer_index: int
    producer_sub: int
    index: int
    sub: int
    block: int

    @classmethod
    def parse(cls, value: int) -> Dispatched:
        """Read the 64 bits of an entry."""
        return cls(
            value & 0xFF,
            value >> 16 & 0xFFFF,
            value >> 8 & 0xFF,
            value >> 40 & 0xFFFF,
            value >> 32 & 0xFF,
            value >> 56 & 0xFF,
        )

    def encode(self) -> int:
        """Return the 64 bits of an entry."""
        local = self.block << 24 | self.index << 8 | self.sub
        return local << 32 | self.producer_index << 16 | self.producer_sub << 8 | self.node_id


@dataclass(frozen=True, slots=True)
class Mpdo:
    """A multiplexed PDO, which names one object and contains its value (CiA 301, MPDO protocol).

    Attributes:
        destination: whether the MPDO is in destination address mode. Then the other fields name an
            object of the consumer, otherwise an object of the producer.
        node_id: node-ID of the consumer or the producer. In destination address mode 0 means all
            nodes.
        index: index of the object in that node.
        sub: sub-index of the object in that node.
        data: data of four bytes, padded with zeros.
    """

    destination: bool
    node_id: int
    index: int
    sub: int
    data: bytes

    def __post_init__(self) -> None:
        """Raise FieldError if there are more than four bytes or a node-ID above 127."""
        if len(self.data) > MPDO_DATA_BYTES:
            raise FieldError(f"{len(self.data)} bytes, an MPDO carries {MPDO_DATA_BYTES}")
        if not 0 <= self.node_id <= _NODE_ID_MASK:
            raise FieldError(f"node-ID {self.node_id} is not in 0..{_NODE_ID_MASK}")

    @classmethod
    def parse(cls, data: bytes) -> Mpdo:
        """Read the data of a frame; raise FramingError unless there are eight bytes."""
        if len(data) != MAX_PDO_BYTES:
            raise FramingError(f"{len(data)} bytes, an MPDO has {MAX_PDO_BYTES}")
        return cls(
            bool(data[0] & _DESTINATION),
            data[0] & _NODE_ID_MASK,
            data[1] | data[2] << 8,
            data[3],
            data[4:],
        )

    def encode(self) -> bytes:
        """Return the data of a frame."""
        # 85 00 20 01 d1 d2 d3 d4: destination mode and node 5, index, sub-index, data.
        address = self.node_id | (_DESTINATION if self.destination else 0)
        head = bytes((address, self.index & 0xFF, self.index >> 8, self.sub))
        return head + self.data.ljust(MPDO_DATA_BYTES, b"\0")


def pack_bits(fields: Iterable[tuple[int, int]]) -> bytes:
    """Pack values with given numbers of bits into bytes, as in a PDO.

    The first value begins at the lowest bit of the first byte. The last byte is filled with zeros.

    Args:
        fields: pairs of value and number of bits. Excess bits of a value are dropped.
    """
    number = position = 0
    for value, bits in fields:
        number |= (value & (1 << bits) - 1) << position
        position += bits
    return number.to_bytes((position + 7) // 8, "little")


def unpack_bits(data: bytes, widths: Iterable[int]) -> tuple[int, ...]:
    """Unpack values; missing bits are 0."""
    number = int.from_bytes(data, "little")
    values = []
    for bits in widths:
        values.append(number & (1 << bits) - 1)
        number >>= bits
    return tuple(values)
