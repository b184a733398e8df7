"""The order in which objects of the communication area can be written back (CiA 301, 7.5.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from tickrig.host.canopen.conform.notation.names import Address
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, FLAG_30, INVALID

Values = dict[Address, bytes]
Write = tuple[Address, bytes]

SYNC: Final = 0x1005
CYCLE: Final = 0x1006
SYNC_COUNTER: Final = 0x1019
EMCY: Final = 0x1014
CONSUMERS: Final = 0x1016
SERVERS: Final = range(0x1200, 0x1300)
PDOS: Final = (range(0x1400, 0x1600), range(0x1800, 0x1A00))
MAPPINGS: Final = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))
TO_MAPPING: Final = 0x200


def in_order(values: Mapping[Address, bytes], number: Callable[[Address], int]) -> Iterator[Write]:
    """Yield what to write, one after the other, to bring objects to their values.

    A PDO is disabled while its parameters change, its mapping is emptied first; SYNC is
    stopped, EMCY and SDO servers are disabled while their COB-ID changes.

    Args:
        values: what the objects shall hold.
        number: reads an object of the node, as an unsigned number.
    """
    left = dict(values)
    for pdo in sorted({_pdo_of(index) for index, _ in values} - {0}):
        yield from _pdo(pdo, left, number)
    if left.keys() & {(SYNC, 0), (CYCLE, 0), (SYNC_COUNTER, 0)}:
        yield from _sync(left, number)
    for at in [at for at in left if at[0] == EMCY or at[0] in SERVERS]:
        yield from _cob_id(at, left.pop(at), number)
    yield from [(at, bytes(len(value))) for at, value in left.items() if at[0] == CONSUMERS]
    yield from left.items()


def _pdo_of(index: int) -> int:
    """Return the communication parameter of a PDO to which an index belongs, 0 for none."""
    if any(index in area for area in PDOS):
        return index
    return index - TO_MAPPING if any(index in area for area in MAPPINGS) else 0


def _pdo(pdo: int, left: Values, number: Callable[[Address], int]) -> Iterator[Write]:
    cob_id_at, mapping = (pdo, 1), pdo + TO_MAPPING
    before = number(cob_id_at)
    wanted = int.from_bytes(left.pop(cob_id_at, _u32(before)), "little")
    yield cob_id_at, _u32(before | INVALID)
    yield cob_id_at, _u32(wanted | INVALID)
    mapped = {at: left.pop(at) for at in sorted(left) if at[0] == mapping}
    if mapped:
        count = mapped.pop((mapping, 0), None) or bytes([number((mapping, 0))])
        yield (mapping, 0), b"\0"
        yield from mapped.items()
        yield (mapping, 0), count
    yield from [(at, left.pop(at)) for at in sorted(left) if at[0] == pdo]
    if not wanted & INVALID:
        yield cob_id_at, _u32(wanted)


def _sync(left: Values, number: Callable[[Address], int]) -> Iterator[Write]:
    """Stop the producer, write counter and period, and let it run as it shall."""
    cob_id = left.pop((SYNC, 0), None) or _u32(number((SYNC, 0)))
    cycle = left.pop((CYCLE, 0), None)
    if cycle is None and (SYNC_COUNTER, 0) in left:
        cycle = _u32(number((CYCLE, 0)))
    yield (SYNC, 0), _u32(number((SYNC, 0)) & ~FLAG_30)
    if cycle is not None:
        yield (CYCLE, 0), bytes(4)
    if (SYNC_COUNTER, 0) in left:
        yield (SYNC_COUNTER, 0), left.pop((SYNC_COUNTER, 0))
    if cycle is not None:
        yield (CYCLE, 0), cycle
    yield (SYNC, 0), _u32(int.from_bytes(cob_id, "little") & ~FLAG_30)
    yield (SYNC, 0), cob_id


def _cob_id(at: Address, value: bytes, number: Callable[[Address], int]) -> Iterator[Write]:
    wanted, before = int.from_bytes(value, "little"), number(at)
    if before & CAN_ID_MASK != wanted & CAN_ID_MASK:
        yield at, _u32(before | INVALID)
        yield at, _u32(wanted | INVALID)
    yield at, value


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")
