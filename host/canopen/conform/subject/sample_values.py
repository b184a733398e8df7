"""Values with which an object of a node is written: allowed ones, and such as must be refused."""

from __future__ import annotations

import struct
from typing import Final

from tickrig.host.canopen.conform.binding.binding import BoundObject
from tickrig.host.canopen.conform.notation.names import Unbound
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import EntryDescription

PATTERNS: Final = tuple(
    map(
        bytes.fromhex,
        ("A5345678F1E2D3C4", "5AC3877A1E2D3C4B", "694B9621D2A57896", "962D4BE127C3B45A"),
    )
)
"""Values no byte of which is another's: what is swapped or cut is seen."""
TEXTS: Final = (b"conformance", b"tested node")
BOOLEANS: Final = (b"\x01", b"\x00")
REALS: Final = (1.5, -2.25)
FORMATS: Final = {DataType.REAL32: "<f", DataType.REAL64: "<d"}


def sample_value(name: str, attribute: str, bound: BoundObject) -> str:
    """Return a value in hex as it goes over the bus.

    Args:
        name: in the check, for the message.
        attribute: `new` or `other`, two allowed values, which it neither holds nor begins with if
            there are enough; `old`, what it held; `low` and `high`; `below` and
            `above` them; `map`, its mapping entry; `longmap`, one twice as long.
        bound: the object.

    Raises:
        Unbound: it has no such value.
    """
    entry = bound.entry
    match attribute:
        case "map" | "longmap":
            bits = entry.data_type.bits << (attribute == "longmap")
            return bytes([bits, entry.sub, *entry.index.to_bytes(2, "little")]).hex().upper()
        case "new" | "other":
            number = ("new", "other").index(attribute)
            return _allowed(name, bound, number).hex().upper()
        case "old" if bound.value is not None:
            return bound.value.hex().upper()
        case "low" | "high" | "below" | "above":
            return _limit(name, entry, attribute).hex().upper()
    raise Unbound(name, f"{entry.index:04X}h:{entry.sub:02X} has no {attribute}")


def _allowed(name: str, bound: BoundObject, number: int) -> bytes:
    entry = bound.entry
    kind = entry.data_type
    if kind is DataType.BOOLEAN:
        return BOOLEANS[number]
    if kind in FORMATS:
        return struct.pack(FORMATS[kind], REALS[number])
    if not kind.is_integer:
        return TEXTS[number][: entry.max_bytes]
    if entry.low is None and entry.high is None:
        values = [pattern[: kind.size] for pattern in PATTERNS]
    else:
        low, high = _limits(entry)
        if low == high:
            raise Unbound(name, f"{entry.index:04X}h:{entry.sub:02X} has only the value {low}")
        some = dict.fromkeys((low, high, (low + high) // 2, low + 1))
        values = [value.to_bytes(kind.size, "little", signed=kind.signed) for value in some]
    unused = [value for value in values if value not in {bound.value, entry.default}]
    return [*unused, *(value for value in values if value not in unused)][number]


def _limits(entry: EntryDescription) -> tuple[int, int]:
    lowest, highest = entry.data_type.limits
    low = lowest if entry.low is None else int(entry.low)
    return low, highest if entry.high is None else int(entry.high)


def _limit(name: str, entry: EntryDescription, attribute: str) -> bytes:
    low, high = _limits(entry)
    value = {"low": low, "high": high, "below": low - 1, "above": high + 1}[attribute]
    try:
        return value.to_bytes(entry.size, "little", signed=entry.signed)
    except OverflowError:
        raise Unbound(name, f"nothing is {attribute} the limits of {entry.index:04X}h") from None
