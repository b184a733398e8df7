"""The order in which objects of the communication area can be written back (CiA 301, 7.5.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from tickrig.host.canopen.conform.check import Address
from tickrig.wire.canopen.nmt import CAN_ID_MASK, FLAG_30, INVALID

Values = dict[Address, bytes]
Write = tuple[Address, bytes]
_Number = Callable[[Address], int | None]

_SYNC: Final = 0x1005
_CYCLE: Final = 0x1006
_SYNC_COUNTER: Final = 0x1019
_EMCY: Final = 0x1014
_CONSUMERS: Final = 0x1016
_SERVERS: Final = range(0x1200, 0x1300)
PDOS: Final = frozenset((*range(0x1400, 0x1600), *range(0x1800, 0x1A00)))
"""Communication parameters of all PDOs."""
_MAPPINGS: Final = frozenset((*range(0x1600, 0x1800), *range(0x1A00, 0x1C00)))
_TO_MAPPING: Final = 0x200
_COB_ID_BYTES: Final = 4


def in_order(values: Mapping[Address, bytes], number: _Number) -> Iterator[Write]:
    """Yield the SDO writes that set objects to given values, in an order that CiA 301 allows.

    A PDO is disabled while its parameters change, and its mapping is emptied first. SYNC is stopped
    while its parameters change. EMCY and SDO servers are disabled while their COB-ID changes.

    Args:
        values: wanted value of each object, by index and sub-index.
        number: function that reads an object of the node as an unsigned number. It returns None if
            the value is unknown.
    """
    left = {at: value for at, value in values.items() if is_standard(at, value)}
    odd = {at: value for at, value in values.items() if at not in left}
    for pdo in sorted({_pdo_of(index) for index, _ in values} - {0}):
        yield from _pdo(pdo, left, number)
    if left.keys() & {(_SYNC, 0), (_CYCLE, 0), (_SYNC_COUNTER, 0)}:
        yield from _sync(left, number)
    for at in [at for at in left if at[0] == _EMCY or _is_server(at)]:
        yield from _cob_id(at, left.pop(at), number)
    yield from [(at, bytes(len(value))) for at, value in left.items() if at[0] == _CONSUMERS]
    yield from (left | odd).items()


def is_standard(at: Address, value: bytes) -> bool:
    """Return whether a value has the length that CiA 301 defines for its object.

    Only the lengths of COB-IDs and of the numbers of mapped objects are checked. For other objects,
    the result is True.
    """
    return len(value) == (_bytes_of(at) or len(value))


def is_too_long(at: Address, value: bytes) -> bool:
    """Return whether a value does not fit into the length that CiA 301 defines for its object.

    A longer value fits if its additional bytes are 0. Only COB-IDs and the numbers of mapped
    objects are checked. For other objects, the result is False.
    """
    return bool((size := _bytes_of(at)) and value[size:].strip(b"\0"))


def _bytes_of(at: Address) -> int:
    """Return the length of a COB-ID or a number of mapped objects, or 0 for other objects."""
    index, sub = at
    if index in _MAPPINGS and not sub:
        return 1
    pdo_cob_id = sub == 1 and index in PDOS
    return _COB_ID_BYTES if pdo_cob_id or at in {(_SYNC, 0), (_EMCY, 0)} or _is_server(at) else 0


def _is_server(at: Address) -> bool:
    return at[0] in _SERVERS and at[1] in {1, 2}


def _pdo_of(index: int) -> int:
    """Return the communication parameter of the PDO to which an index belongs, or 0 for none."""
    if index in PDOS:
        return index
    return index - _TO_MAPPING if index in _MAPPINGS else 0


def _pdo(pdo: int, left: Values, number: _Number) -> Iterator[Write]:
    cob_id_at, mapping = (pdo, 1), pdo + _TO_MAPPING
    given, before = left.pop(cob_id_at, None), number(cob_id_at)
    wanted = before if given is None else int.from_bytes(given, "little")
    if wanted is not None:
        yield cob_id_at, _u32((wanted if before is None else before) | INVALID)
        yield cob_id_at, _u32(wanted | INVALID)
    mapped = {at: left.pop(at) for at in sorted(left) if at[0] == mapping}
    if mapped:
        count = mapped.pop((mapping, 0), None)
        if count is None and (held := number((mapping, 0))) is not None:
            count = bytes([held])
        if count is not None:
            yield (mapping, 0), b"\0"
        yield from mapped.items()
        if count is not None:
            yield (mapping, 0), count
    yield from [(at, left.pop(at)) for at in sorted(left) if at[0] == pdo]
    if wanted is not None and not wanted & INVALID:
        yield cob_id_at, _u32(wanted)


def _sync(left: Values, number: _Number) -> Iterator[Write]:
    """Stop the SYNC producer, write counter and period, and restart an enabled producer."""
    given, before = left.pop((_SYNC, 0), None), number((_SYNC, 0))
    cycle = left.pop((_CYCLE, 0), None)
    if cycle is None and (_SYNC_COUNTER, 0) in left and (known := number((_CYCLE, 0))) is not None:
        cycle = _u32(known)
    if before is not None:
        yield (_SYNC, 0), _u32(before & ~FLAG_30)
    if cycle is not None:
        yield (_CYCLE, 0), bytes(len(cycle))
    if (_SYNC_COUNTER, 0) in left:
        yield (_SYNC_COUNTER, 0), left.pop((_SYNC_COUNTER, 0))
    if cycle is not None:
        yield (_CYCLE, 0), cycle
    wanted = before if given is None else int.from_bytes(given, "little")
    if wanted is not None:
        yield (_SYNC, 0), _u32(wanted & ~FLAG_30)
        yield (_SYNC, 0), _u32(wanted)


def _cob_id(at: Address, value: bytes, number: _Number) -> Iterator[Write]:
    wanted, before = int.from_bytes(value, "little"), number(at)
    if before is not None and before & CAN_ID_MASK != wanted & CAN_ID_MASK:
        yield at, _u32(before | INVALID)
        yield at, _u32(wanted | INVALID)
    yield at, value


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")
