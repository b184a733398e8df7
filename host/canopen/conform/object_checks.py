"""The checks of the objects that an EDS describes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Final

from tickrig.host.canopen.conform import check
from tickrig.host.canopen.conform.binding.wanted import COMMUNICATION_AREA, PROFILE_AREA
from tickrig.host.canopen.conform.write_order import PDOS
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_entry import COUNTS
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

# The SDO abort codes that are accepted for each kind of refusal.
#
# Where CiA 301 leaves a choice, the codes are those that CiA's own conformance test tool accepts,
# as its published log shows (CCT 3.0.3.10, test cases SDO 03 to SDO 10).

_READ_ONLY: Final = ("06010002", "06010000", "08000000")
_WRITE_ONLY: Final = ("06010001", "06010000", "08000000")
_ABSENT_OBJECT: Final = ("06020000",)
_ABSENT_SUB: Final = ("06090011",)
_TOO_LONG: Final = ("06070012", "06070010", "08000000")
_TOO_SHORT: Final = ("06070013", "06070010", "08000000")
_TOO_HIGH: Final = ("06090031", "06090030")
_TOO_LOW: Final = ("06090032", "06090030")
_NO_VALUE_YET: Final = ("08000024", "08000000", "06090011")
"""Objects that may have no value, such as an error that never occurred, or an empty domain."""


# Checks of 1000h: a device must have the objects of the profile that it declares.

_DEVICE_TYPE: Final = 0x1000
_PROFILE_MASK: Final = 0xFFFF

_IO_BLOCKS: Final[Mapping[int, tuple[int, ...]]] = {
    16: (0x6000, 0x6020, 0x6100, 0x6120),
    17: (0x6200, 0x6220, 0x6300, 0x6320),
    18: (0x6401, 0x6400, 0x6402, 0x6403, 0x6404),
    19: (0x6411, 0x6410, 0x6412, 0x6413, 0x6414),
}
"""Bits of 1000h of a CiA 401 device, and the objects of which one must exist if the bit is set."""

_DRIVE_OBJECTS: Final = (0x6040, 0x6041)
"""Controlword and statusword, which every drive has."""


def _profile_checks(device: EdsDevice, node_id: int) -> Iterator[check.Check]:
    """Yield the check of 1000h if the EDS gives the value of this object.

    Args:
        device: device that the EDS describes.
        node_id: node-ID of the node, 1..127.
    """
    entries = {(entry.index, entry.sub): entry for entry in device.entries}
    head = entries.get((_DEVICE_TYPE, 0))
    if head is None or not head.has_default:
        return
    number = int.from_bytes(head.power_on_data(node_id), "little")
    wanted, source = _wanted(number, {index for index, _ in entries})
    if wanted:
        names = ", ".join(f"{index:04X}h" for index in wanted)
        title = f"1000h: has the objects of the profile that it names: {names}"
        clause, steps = f"CiA 301 v4.2.0, 7.5.2.1; {source}", tuple(_reads(entries, wanted))
        level = check.Level.READ_ONLY
        yield check.Check("OD-1000.00-profile", "OD", title, clause, level, frozenset(), steps)


def _wanted(number: int, present: set[int]) -> tuple[tuple[int, ...], str]:
    """Return the objects that a device type requires.

    Of several alternatives, return the one in the EDS.
    """
    match number & _PROFILE_MASK:
        case 401:
            blocks = [objects for bit, objects in _IO_BLOCKS.items() if number >> bit & 1]
            found = [[*present.intersection(objects), objects[0]][0] for objects in blocks]
            return tuple(found), "CiA 401-1, device type"
        case 402:
            return _DRIVE_OBJECTS, "CiA 402-2, controlword and statusword"
    return (), ""


def _reads(
    entries: Mapping[tuple[int, int], EntryDescription], indices: Iterable[int]
) -> Iterator[check.Step]:
    for index in indices:
        entry = entries.get((index, 0))
        kind = "UNSIGNED8" if index not in _DRIVE_OBJECTS else "UNSIGNED16"
        yield check.Step(check.Hold((index, 0), entry.data_type.name if entry else kind))


# Checks of every object that an EDS describes: readable, and refused as declared.

_GROUP: Final = "OD"
_ABORTS: Final = "CiA 301 v4.2.0, 7.2.4.3.17, table of SDO abort codes"
_ACCESS: Final = "CiA 301 v4.2.0, 7.4.4, access attributes"
_TYPES: Final = "CiA 301 v4.2.0, 7.4.7, data types"
_DEFAULTS: Final = "CiA 306-1, DefaultValue; CiA 301 v4.2.0, 7.5.2"

_NEVER_WRITTEN: Final = (0x1010, 0x1011, *range(0x1F50, 0x1F5A))
"""Objects of store, restore and program download.

The tester never writes these objects, not even to provoke a refusal.
"""

_ERROR_FIELD: Final = 0x1003
_CONSTANTS: Final = (0x1000, 0x1018)
"""Objects that have the value in the EDS unless the bus can write them."""
_IN_USE: Final = (*(0x1005, 0x1006, 0x1012, 0x1014), *range(0x1200, 0x1300), *range(0x1400, 0x1C00))
"""Objects that CiA 301 protects from changes while the function that they configure is enabled."""
_KEPT: Final = (
    *("06010000", "06010001", "06010002", "06040041", "06040042", "06040043", "06040047"),
    *("06090030", "08000000", "08000021", "08000022"),
)
"""Abort codes of this protection. A server may refuse a write before it checks the value."""
_RESERVED_SUB: Final = 4
"""Reserved sub-index of a PDO parameter. Some EDS files describe it."""
_SERIAL_NUMBER: Final = (0x1018, 4)
_DATA_TYPES: Final = range(0x0001, 0x1000)
_HIGHEST_SUB: Final = 0xFF
_CONFIGURED: Final = "the node may have been configured: stored, or written since its reset"


class _Maker:
    """Factory for the object checks of one node.

    Args:
        node_id: node-ID of the node, 1..127.
        allow: indices of the profile area that may be written.
        never: indices that are never written.
    """

    def __init__(self, node_id: int, allow: Collection[int], never: Collection[int]) -> None:
        self._node_id, self._allow, self._never = node_id, allow, never

    def of_entry(self, entry: EntryDescription, counts: bool) -> Iterator[check.Check]:
        """Make the checks for one entry of the object dictionary, from its EDS description.

        Args:
            entry: entry with its data type, access and limits.
            counts: whether the entry is the sub-index 0 of a record, whose value is the highest
                sub-index of the record.
        """
        if entry.readable:
            constant = self._power_on(entry) if _is_constant(entry, counts) else None
            yield _holds(entry, constant)
            if constant is None:
                yield from self._default(entry)
        else:
            refused = check.RefuseRead((entry.index, entry.sub), _WRITE_ONLY)
            yield _check(entry, "read", "refused to be read", _ACCESS, refused)
        if self._may_write(entry.index):
            if not entry.writable:
                yield _refused(entry, "write", "read-only: refused to be written", 0, _READ_ONLY)
            elif entry.readable:
                yield from _of_sizes(entry)
            if entry.writable and entry.data_type.is_integer:
                yield from _of_limits(entry)

    def _default(self, entry: EntryDescription) -> Iterator[check.Check]:
        """Compare writable objects of the communication area with their defaults."""
        value = self._power_on(entry)
        if value is None or not entry.writable or entry.index not in COMMUNICATION_AREA:
            return
        if entry.index != _ERROR_FIELD:
            title, action = "as its DefaultValue says", _hold(entry, value)
            yield _check(entry, "default", title, _DEFAULTS, action, choice=_CONFIGURED)

    def _power_on(self, entry: EntryDescription) -> str | None:
        if not entry.has_default:
            return None
        return entry.power_on_data(self._node_id).hex().upper()

    def _may_write(self, index: int) -> bool:
        if index in _NEVER_WRITTEN or index in self._never:
            return False
        return index not in PROFILE_AREA or index in self._allow


def object_checks(
    device: EdsDevice,
    node_id: int,
    *,
    allow: Collection[int] = (),
    never: Collection[int] = (),
    may_choose: Callable[[str, str], bool] = lambda group, place: True,
) -> tuple[check.Check, ...]:
    """Make the checks of all objects, sorted by index and sub-index.

    The checks also read places that the EDS does not describe:

    - in every object, the sub-indices between and after the described ones, and FEh and FFh
    - over all objects together, each sub-index up to FFh once
    - after every series of consecutive indices, the next index

    Args:
        device: device that the EDS describes.
        node_id: node-ID of the node, 1..127, for defaults with $NODEID.
        allow: indices of the profile area, 6000h to 9FFFh, that may be written.
        never: indices that are never written.
        may_choose: function that returns whether a check may be selected. Its arguments are the
            group of the check, and the beginning of its id after the group. Other checks may be
            omitted, which does not change the remaining checks.
    """
    maker, checks = _Maker(node_id, allow, never), list[check.Check]()
    entries = sorted(device.entries, key=attrgetter("key"))
    objects = [(index, list(rows)) for index, rows in groupby(entries, attrgetter("index"))]
    for number, (index, rows) in enumerate(objects):
        place = f"{index:04X}"
        if not may_choose(_GROUP, place):
            continue
        for entry in rows:
            if may_choose(_GROUP, f"{place}.{entry.sub:02X}"):
                checks += maker.of_entry(entry, counts=entry.sub == 0 and len(rows) > 1)
        if may_choose(_GROUP, f"{place}-"):
            share = range(number % len(objects), _HIGHEST_SUB + 1, len(objects))
            checks.append(_absent_subs(index, rows, share))
    if may_choose(_GROUP, "absent"):
        checks.append(_absent_objects([index for index, _ in objects]))
    return (*checks, *_profile_checks(device, node_id))


def _check(  # noqa: PLR0913, PLR0917 - a check, by its parts
    entry: EntryDescription,
    suffix: str,
    title: str,
    source: str,
    action: check.Action,
    level: check.Level = check.Level.READ_ONLY,
    choice: str = "",
) -> check.Check:
    where = f"{entry.index:04X}.{entry.sub:02X}"
    name = f"{entry.index:04X}h:{entry.sub:02X} {entry.name}"
    return check.Check(
        *(f"OD-{where}-{suffix}", _GROUP, f"{name}: {title}", source, level),
        *(frozenset(), (check.Step(action),), choice),
    )


def _holds(entry: EntryDescription, constant: str | None) -> check.Check:
    """Make the check of the value of an entry."""
    action = _hold(entry, constant)
    title = f"holds {entry.data_type.name}"
    if constant is None:
        return _check(entry, "type", title, _TYPES, action)
    return _check(entry, "type", f"{title}, its DefaultValue", f"{_TYPES}; {_DEFAULTS}", action)


def _hold(entry: EntryDescription, value: str | None) -> check.Hold:
    """Make the step that reads an entry. A value is hexadecimal."""
    codes = _NO_VALUE_YET if _may_have_none(entry) else ()
    at, kind = (entry.index, entry.sub), entry.data_type.name
    return check.Hold(at, kind, entry.low, entry.high, value, codes)


def _refused(
    entry: EntryDescription, suffix: str, title: str, grow: int, codes: Sequence[str]
) -> check.Check:
    """Make a check that writes the read value back, longer by `grow`.

    The node must refuse the write.
    """
    action = check.RefuseRewrite((entry.index, entry.sub), grow, _codes(entry, codes))
    return _check(entry, suffix, title, _ABORTS, action, check.Level.COMMUNICATION)


def _of_sizes(entry: EntryDescription) -> Iterator[check.Check]:
    if entry.size:
        yield _refused(entry, "long", "a byte too long: refused", 1, _TOO_LONG)
    if entry.size > 1:
        yield _refused(entry, "short", "a byte too short: refused", -1, _TOO_SHORT)


def _of_limits(entry: EntryDescription) -> Iterator[check.Check]:
    """Write the numbers just beyond the limits, if the data type has such numbers."""
    lowest, highest = entry.data_type.limits
    for suffix, limit, beyond, codes in (
        ("high", entry.high, 1, _TOO_HIGH),
        ("low", entry.low, -1, _TOO_LOW),
    ):
        if isinstance(limit, int) and lowest <= limit + beyond <= highest:
            data = (limit + beyond).to_bytes(entry.size, "little", signed=entry.signed)
            title = f"{limit + beyond} is beyond its limit {limit}: refused"
            at, refused = (entry.index, entry.sub), _codes(entry, codes)
            action = check.RefuseWrite(at, data.hex().upper(), refused)
            yield _check(entry, suffix, title, _ABORTS, action, check.Level.COMMUNICATION)


def _codes(entry: EntryDescription, codes: Sequence[str]) -> tuple[str, ...]:
    """Return the codes that refuse a write because of the value or because the object is in use."""
    return (*dict.fromkeys([*codes, *(_KEPT if entry.index in _IN_USE else ())]),)


def _absent_subs(index: int, rows: list[EntryDescription], share: Collection[int]) -> check.Check:
    """Read sub-indices that the EDS does not describe."""
    known = {row.sub for row in rows}
    behind = max(known) + 1
    asked = {*range(behind + 1), _HIGHEST_SUB - 1, *share} - known
    steps = [
        check.Step(check.RefuseRead((index, sub), _ABSENT_SUB))
        for sub in sorted(asked)
        if sub < _HIGHEST_SUB
    ]
    if _HIGHEST_SUB not in known:
        structure = check.Hold((index, _HIGHEST_SUB), "UNSIGNED32", codes=_ABSENT_SUB)
        steps.append(check.Step(structure))
    name = rows[0].name if len(rows) == 1 else "its sub-indices"
    title = f"{index:04X}h {name}: has no sub-index that is not described"
    level, source = check.Level.READ_ONLY, _ABORTS
    return check.Check(
        f"OD-{index:04X}-subs", _GROUP, title, source, level, frozenset(), tuple(steps)
    )


def _absent_objects(indices: Collection[int]) -> check.Check:
    """Read the index after each row of objects, and the last index of each area."""
    ends = (0x1FFF, 0x5FFF, 0x9FFF, 0xFFFF)
    behind = {index + 1 for index in indices if index < 0xFFFF} | set(ends)
    asked = sorted(behind - set(indices) - set(_DATA_TYPES))
    steps = tuple(check.Step(check.RefuseRead((index, 0), _ABSENT_OBJECT)) for index in asked)
    title = "objects that are not described do not exist"
    return check.Check(
        "OD-absent", _GROUP, title, _ABORTS, check.Level.READ_ONLY, frozenset(), steps
    )


def _is_constant(entry: EntryDescription, counts: bool) -> bool:
    """Return whether an entry always holds its default."""
    if entry.writable or (entry.index, entry.sub) == _SERIAL_NUMBER:
        return False
    if Access.CONST in entry.access or entry.index in _CONSTANTS:
        return True
    return counts and entry.index not in COUNTS and entry.index in COMMUNICATION_AREA


def _may_have_none(entry: EntryDescription) -> bool:
    """Return whether an entry may have no value, such as an error history or an empty string."""
    reserved = entry.index in PDOS and entry.sub == _RESERVED_SUB
    return reserved or entry.index == _ERROR_FIELD or not entry.size
