"""The names of objects in checks, and which object of a dictionary is of that kind."""

from __future__ import annotations

from collections.abc import Callable
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

_Fits = Callable[[EntryDescription], bool]


class Use(Enum):
    """What is done with an object."""

    READ = "read, or mapped where it is only read"
    REFUSED = "written, and the node must refuse it"
    WRITE = "written, and restored"


class WantedObject(NamedTuple):
    """A name and what it stands for.

    Attributes:
        name: in checks, after `$`.
        what: for people.
        use: what is done with it.
        fits: whether a description is of this kind.
        suits: whether a value is.
    """

    name: str
    what: str
    use: Use
    fits: _Fits
    suits: Callable[[bytes], bool] = bool


def _any(value: bytes) -> bool:
    return True


def _free(entry: EntryDescription) -> bool:
    """Return whether an object takes what its description says, without rules of CiA 301."""
    return entry.index not in COMMUNICATION_AREA or entry.index in HARMLESS


def _both(entry: EntryDescription) -> bool:
    return entry.readable and entry.writable and _free(entry)


def _integer(entry: EntryDescription, bits: int) -> bool:
    return entry.data_type.is_integer and entry.data_type.bits == bits


def _rw(bits: int) -> WantedObject:
    what = f"integer of {bits} bits that may be read and written"
    return WantedObject(
        f"rw_u{bits}", what, Use.WRITE, lambda entry: _both(entry) and _integer(entry, bits)
    )


def _ro(bits: int) -> WantedObject:
    what = f"integer of {bits} bits that may only be read"
    return WantedObject(
        f"ro_u{bits}",
        what,
        Use.REFUSED,
        lambda entry: entry.readable and not entry.writable and _integer(entry, bits),
    )


def _mapped(way: str, access: Access, bits: int) -> WantedObject:
    what = f"integer of {bits} bits that may be read, written and mapped into {way.upper()}s"
    return WantedObject(
        f"{way}_u{bits}",
        what,
        Use.WRITE,
        lambda entry: _both(entry) and access in entry.access and _integer(entry, bits),
    )


def _limited(entry: EntryDescription) -> bool:
    """Return whether there are values of its type on both sides of its limits."""
    kind = entry.data_type
    if not _both(entry) or not kind.is_integer or entry.low is None or entry.high is None:
        return False
    lowest, highest = kind.limits
    return lowest < entry.low and entry.high < highest


def _mapping(entry: EntryDescription) -> Access:
    return entry.access & (Access.TPDO | Access.RPDO)


def _fixed(name: str, index: int, sub: int, what: str, use: Use = Use.WRITE) -> WantedObject:
    where = f"{index:04X}h:{sub:02X}, {what}"
    return WantedObject(name, where, use, lambda entry: (entry.index, entry.sub) == (index, sub))


WANTED: Final[tuple[WantedObject, ...]] = (
    *(_rw(bits) for bits in _SIZES),
    *(_ro(bits) for bits in _SIZES),
    *(_mapped("tpdo", Access.TPDO, bits) for bits in _SIZES),
    *(_mapped("rpdo", Access.RPDO, bits) for bits in _SIZES),
    WantedObject(
        "tpdo_bool",
        "BOOLEAN that may be read, written and mapped into TPDOs",
        Use.WRITE,
        lambda entry: (
            _both(entry) and Access.TPDO in entry.access and entry.data_type is DataType.BOOLEAN
        ),
    ),
    WantedObject(
        "rpdo_bool",
        "BOOLEAN that may be read, written and mapped into RPDOs",
        Use.WRITE,
        lambda entry: (
            _both(entry) and Access.RPDO in entry.access and entry.data_type is DataType.BOOLEAN
        ),
    ),
    WantedObject(
        "rw_bool",
        "BOOLEAN that may be read and written",
        Use.WRITE,
        lambda entry: _both(entry) and entry.data_type is DataType.BOOLEAN,
    ),
    WantedObject(
        "rw_real32",
        "REAL32 that may be read and written",
        Use.WRITE,
        lambda entry: _both(entry) and entry.data_type is DataType.REAL32,
    ),
    WantedObject(
        "limited", "writable integer with both limits inside its type", Use.WRITE, _limited
    ),
    WantedObject("ro", "read-only object", Use.REFUSED, lambda e: e.readable and not e.writable),
    WantedObject(
        "wo",
        "write-only object",
        Use.REFUSED,
        lambda entry: entry.writable and not entry.readable,
        _any,
    ),
    WantedObject("const", "constant", Use.REFUSED, lambda entry: Access.CONST in entry.access),
    WantedObject(
        "ro_string",
        "string that may only be read",
        Use.REFUSED,
        lambda entry: entry.readable and not entry.writable and entry.data_type in TEXTS,
    ),
    WantedObject(
        "long_string",
        "readable string of more than 7 bytes, which has at least two segments",
        Use.READ,
        lambda entry: entry.readable and entry.data_type in TEXTS,
        lambda value: len(value) > _SEGMENT_BYTES,
    ),
    WantedObject(
        "short_string",
        "readable string of 1 to 4 bytes",
        Use.READ,
        lambda entry: entry.readable and entry.data_type in TEXTS,
        lambda value: 1 <= len(value) <= _EXPEDITED_BYTES,
    ),
    WantedObject(
        "string",
        "string that may be read and written",
        Use.WRITE,
        lambda entry: _both(entry) and entry.data_type in TEXTS,
        _any,
    ),
    WantedObject(
        "domain",
        "domain that may be read and written",
        Use.WRITE,
        lambda entry: _both(entry) and entry.data_type is DataType.DOMAIN,
        _any,
    ),
    WantedObject(
        "tpdo_only",
        "readable object that may be mapped into TPDOs and not into RPDOs",
        Use.READ,
        lambda entry: entry.readable and not entry.writable and _mapping(entry) is Access.TPDO,
    ),
    WantedObject(
        "rpdo_only",
        "write-only object that may be mapped into RPDOs",
        Use.REFUSED,
        lambda entry: not entry.readable and _mapping(entry) is Access.RPDO,
        _any,
    ),
    WantedObject(
        "unmappable",
        "integer that may not be mapped",
        Use.READ,
        lambda entry: entry.data_type.is_integer and not _mapping(entry) and entry.readable,
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
