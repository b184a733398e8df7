"""The names of objects in checks, and which object of a dictionary is of that kind."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from enum import Enum
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

COMMUNICATION_AREA: Final = range(0x1000, 0x2000)
PROFILE_AREA: Final = range(0x6000, 0xA000)
"""Where a write may move something."""

GENERIC_IO: Final = 401
"""The low word of 1000h of a module of CiA 401."""
PLAIN_OUTPUTS: Final = (0x6200, 0x6300, 0x6320, 0x6410, 0x6411, 0x6412)
"""Outputs of CiA 401 take any value; all else of a profile means something: a mode, a position."""

HARMLESS: Final = (0x1015, 0x1007, 0x100D, 0x100C, 0x1017, 0x1006)
"""Communication objects that take any value, and that stand for others of their size."""

TEXTS: Final = (DataType.VISIBLE_STRING, DataType.OCTET_STRING, DataType.UNICODE_STRING)
_EXPEDITED_BYTES: Final = 4
_SEGMENT_BYTES: Final = 7
_SIZES: Final = (8, 16, 32, 64)

_R, _W, _C = Access.READ.value, Access.WRITE.value, Access.CONST.value
_T, _P = Access.TPDO.value, Access.RPDO.value


class Use(Enum):
    """What is done with an object."""

    READ = "read, or mapped where it is only read"
    REFUSED = "written, and the node must refuse it"
    WRITE = "written, and restored"


class EntryFacts(NamedTuple):
    """What decides for which names an entry can stand, found out once for all names.

    Attributes:
        entry: the entry.
        access: the bits of its access.
        kind: the number of its data type.
        free: it takes what its description says, without rules of CiA 301.
    """

    entry: EntryDescription
    access: int
    kind: int
    free: bool


def facts_of(entry: EntryDescription) -> EntryFacts:
    """Find out the facts about an entry."""
    free = entry.index not in COMMUNICATION_AREA or entry.index in HARMLESS
    return EntryFacts(entry, entry.access.value, int(entry.data_type), free)


def _any(value: bytes) -> bool:
    return True


class WantedObject(NamedTuple):
    """A name and what it stands for.

    Attributes:
        name: in checks, after `$`.
        what: for people.
        use: what is done with it.
        access: the bits of the access that are asked for: those that count, and their values.
        kinds: numbers of the data types; None for any.
        free: it must be free of rules of CiA 301.
        limited: there must be values of its type on both sides of its limits.
        at: the only place where it can be, and then nothing else counts.
        suits: whether a value is of this kind.
    """

    name: str
    what: str
    use: Use
    access: tuple[int, int] = (0, 0)
    kinds: Collection[int] | None = None
    free: bool = False
    limited: bool = False
    at: tuple[int, int] | None = None
    suits: Callable[[bytes], bool] = bool

    def fitting(self, facts: Iterable[EntryFacts]) -> list[EntryDescription]:
        """Return the entries that are of this kind, in their order.

        One loop without calls: a tenth of a run of one check was here.
        """
        (mask, wanted), kinds, anyway = self.access, self.kinds, not self.free
        found = [
            entry
            for entry, access, kind, free in facts
            if access & mask == wanted and (kinds is None or kind in kinds) and (free or anyway)
        ]
        return list(filter(_is_limited, found)) if self.limited else found


def _is_limited(entry: EntryDescription) -> bool:
    """Return whether there are values of its type on both sides of its limits."""
    if entry.low is None or entry.high is None:
        return False
    lowest, highest = entry.data_type.limits
    return lowest < entry.low and entry.high < highest


_INTEGERS: Final = frozenset(int(kind) for kind in DataType if kind.is_integer)
_OF_SIZE: Final = {
    bits: frozenset(int(kind) for kind in DataType if kind.is_integer and kind.bits == bits)
    for bits in _SIZES
}
_TEXT_KINDS: Final = frozenset(map(int, TEXTS))
_BOTH: Final = (_R | _W, _R | _W)
_READ_ONLY: Final = (_R | _W, _R)
_WRITE_ONLY: Final = (_R | _W, _W)


def _both(
    name: str,
    what: str,
    kinds: Collection[int],
    mapped: int = 0,
    suits: Callable[[bytes], bool] = bool,
) -> WantedObject:
    """Want an object that may be read and written, and be mapped so."""
    access = (_BOTH[0] | mapped, _BOTH[1] | mapped)
    return WantedObject(name, what, Use.WRITE, access, kinds, free=True, suits=suits)


def _rw(bits: int) -> WantedObject:
    what = f"integer of {bits} bits that may be read and written"
    return _both(f"rw_u{bits}", what, _OF_SIZE[bits])


def _ro(bits: int) -> WantedObject:
    what = f"integer of {bits} bits that may only be read"
    return WantedObject(f"ro_u{bits}", what, Use.REFUSED, _READ_ONLY, _OF_SIZE[bits])


def _mapped(way: str, access: int, bits: int) -> WantedObject:
    what = f"integer of {bits} bits that may be read, written and mapped into {way.upper()}s"
    return _both(f"{way}_u{bits}", what, _OF_SIZE[bits], access)


def _fixed(name: str, index: int, sub: int, what: str, use: Use = Use.WRITE) -> WantedObject:
    return WantedObject(name, f"{index:04X}h:{sub:02X}, {what}", use, at=(index, sub))


_BOOLEAN: Final = (int(DataType.BOOLEAN),)

WANTED: Final[tuple[WantedObject, ...]] = (
    *(_rw(bits) for bits in _SIZES),
    *(_ro(bits) for bits in _SIZES),
    *(_mapped("tpdo", _T, bits) for bits in _SIZES),
    *(_mapped("rpdo", _P, bits) for bits in _SIZES),
    _both("tpdo_bool", "BOOLEAN that may be read, written and mapped into TPDOs", _BOOLEAN, _T),
    _both("rpdo_bool", "BOOLEAN that may be read, written and mapped into RPDOs", _BOOLEAN, _P),
    _both("rw_bool", "BOOLEAN that may be read and written", _BOOLEAN),
    _both("rw_real32", "REAL32 that may be read and written", (int(DataType.REAL32),)),
    WantedObject(
        "limited",
        "writable integer with both limits inside its type",
        Use.WRITE,
        _BOTH,
        _INTEGERS,
        free=True,
        limited=True,
    ),
    WantedObject("ro", "read-only object", Use.REFUSED, _READ_ONLY),
    WantedObject("wo", "write-only object", Use.REFUSED, _WRITE_ONLY, suits=_any),
    WantedObject("const", "constant", Use.REFUSED, (_C, _C)),
    WantedObject("ro_string", "string that may only be read", Use.REFUSED, _READ_ONLY, _TEXT_KINDS),
    WantedObject(
        "long_string",
        "readable string of more than 7 bytes, which has at least two segments",
        Use.READ,
        (_R, _R),
        _TEXT_KINDS,
        suits=lambda value: len(value) > _SEGMENT_BYTES,
    ),
    WantedObject(
        "short_string",
        "readable string of 1 to 4 bytes",
        Use.READ,
        (_R, _R),
        _TEXT_KINDS,
        suits=lambda value: 1 <= len(value) <= _EXPEDITED_BYTES,
    ),
    _both("string", "string that may be read and written", _TEXT_KINDS, suits=_any),
    _both("domain", "domain that may be read and written", (int(DataType.DOMAIN),), suits=_any),
    WantedObject(
        "tpdo_only",
        "readable object that may be mapped into TPDOs and not into RPDOs",
        Use.READ,
        (_R | _W | _T | _P, _R | _T),
    ),
    WantedObject(
        "rpdo_only",
        "write-only object that may be mapped into RPDOs",
        Use.REFUSED,
        (_R | _T | _P, _P),
        suits=_any,
    ),
    WantedObject(
        "unmappable",
        "integer that may not be mapped",
        Use.READ,
        (_R | _T | _P, _R),
        _INTEGERS,
    ),
    _fixed("device_type", 0x1000, 0, "the device type", Use.READ),
    _fixed("error_register", 0x1001, 0, "the error register", Use.READ),
    _fixed("identity_1", 0x1018, 1, "the vendor-ID", Use.READ),
    _fixed("identity_2", 0x1018, 2, "the product code", Use.READ),
    _fixed("identity_3", 0x1018, 3, "the revision number", Use.READ),
    _fixed("error_history", 0x1003, 0, "the error history"),
    _fixed("sync_cob_id", 0x1005, 0, "the COB-ID of SYNC"),
    _fixed("sync_period", 0x1006, 0, "the period of SYNC"),
    _fixed("guard_time", 0x100C, 0, "the guard time"),
    _fixed("life_factor", 0x100D, 0, "the life time factor"),
    _fixed("store", 0x1010, 1, "store parameters"),
    _fixed("restore", 0x1011, 1, "restore default parameters"),
    _fixed("time_cob_id", 0x1012, 0, "the COB-ID of TIME"),
    _fixed("emcy_cob_id", 0x1014, 0, "the COB-ID of EMCY"),
    _fixed("emcy_inhibit", 0x1015, 0, "the inhibit time of EMCY"),
    _fixed("consumer_1", 0x1016, 1, "a heartbeat consumer"),
    _fixed("consumer_2", 0x1016, 2, "a second heartbeat consumer"),
    _fixed("heartbeat", 0x1017, 0, "the producer heartbeat time"),
    _fixed("sync_counter", 0x1019, 0, "the SYNC counter overflow"),
    _fixed("error_behaviour", 0x1029, 1, "the error behaviour"),
    _fixed("startup", 0x1F80, 0, "NMT startup"),
    _fixed("sdo_server_2", 0x1201, 1, "a second SDO server"),
)
