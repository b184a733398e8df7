"""Checks of every object that an EDS describes: readable and refused as it is declared."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Final

from tickrig.host.canopen.conform.check import Check, Level, Step
from tickrig.host.canopen.conform.objects.accepted_codes import (
    ABSENT_OBJECT,
    ABSENT_SUB,
    NO_VALUE_YET,
    READ_ONLY,
    TOO_HIGH,
    TOO_LONG,
    TOO_LOW,
    TOO_SHORT,
    WRITE_ONLY,
)
from tickrig.host.canopen.conform.objects.profile_checks import profile_checks
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_entry import COUNTS
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

GROUP: Final = "OD"
ABORTS: Final = "CiA 301 v4.2.0, 7.2.4.3.17, table of SDO abort codes"
ACCESS: Final = "CiA 301 v4.2.0, 7.4.4, access attributes"
TYPES: Final = "CiA 301 v4.2.0, 7.4.7, data types"
DEFAULTS: Final = "CiA 306-1, DefaultValue; CiA 301 v4.2.0, 7.5.2"

COMMUNICATION_AREA: Final = range(0x1000, 0x2000)
PROFILE_AREA: Final = range(0x6000, 0xA000)
NEVER_WRITTEN: Final = (0x1010, 0x1011, *range(0x1F50, 0x1F5A))
"""Store, restore and program download: not even with what must be refused."""

ERROR_FIELD: Final = 0x1003
CONSTANTS: Final = (0x1000, 0x1018)
"""Objects that hold what the EDS says wherever the bus cannot write them."""
PDO_PARAMETERS: Final = (*range(0x1400, 0x1600), *range(0x1800, 0x1A00))
IN_USE: Final = (*(0x1005, 0x1006, 0x1012, 0x1014), *range(0x1200, 0x1300), *range(0x1400, 0x1C00))
"""Objects that CiA 301 keeps from being changed while what they set up exists."""
KEPT: Final = (
    *("06010000", "06010001", "06010002", "06040041", "06040042", "06040043", "06040047"),
    *("06090030", "08000000", "08000021", "08000022"),
)
"""Codes of that: a server need not look at the value before."""
RESERVED_SUB: Final = 4
"""Of a PDO parameter: CiA 301 keeps it free, and files describe it."""
SERIAL_NUMBER: Final = (0x1018, 4)
DATA_TYPES: Final = range(0x0001, 0x1000)
HIGHEST_SUB: Final = 0xFF
CONFIGURED: Final = "the node may have been configured: stored, or written since its reset"


class _Maker:
    """Makes the checks of one node.

    Args:
        node_id: of the node, 1..127.
        allow: indices of the profile area that may be written.
        never: indices that are never written.
    """

    def __init__(self, node_id: int, allow: Collection[int], never: Collection[int]) -> None:
        self._node_id, self._allow, self._never = node_id, allow, never

    def of_entry(self, entry: EntryDescription, counts: bool) -> Iterator[Check]:
        """Make the checks of one entry; `counts` says whether it is the sub-index 0 of a record."""
        if entry.readable:
            constant = self._power_on(entry) if _is_constant(entry, counts) else None
            yield _holds(entry, constant)
            if constant is None:
                yield from self._default(entry)
        else:
            yield _check(entry, "read", "refused to be read", ACCESS, _refuse_read(entry))
        if self._may_write(entry.index):
            if not entry.writable:
                yield _refused(entry, "write", "read-only: refused to be written", 0, READ_ONLY)
            elif entry.readable:
                yield from _of_sizes(entry)
            if entry.writable and entry.data_type.is_integer:
                yield from _of_limits(entry)

    def _default(self, entry: EntryDescription) -> Iterator[Check]:
        """Compare what the bus may change with its default, in the communication area."""
        value = self._power_on(entry)
        if value is None or not entry.writable or entry.index not in COMMUNICATION_AREA:
            return
        if entry.index != ERROR_FIELD:
            title, step = "as its DefaultValue says", _step(entry, value)
            yield _check(entry, "default", title, DEFAULTS, step, choice=CONFIGURED)

    def _power_on(self, entry: EntryDescription) -> str | None:
        if not entry.has_default:
            return None
        return entry.power_on_data(self._node_id).hex().upper()

    def _may_write(self, index: int) -> bool:
        if index in NEVER_WRITTEN or index in self._never:
            return False
        return index not in PROFILE_AREA or index in self._allow


def object_checks(
    device: EdsDevice,
    node_id: int,
    *,
    allow: Collection[int] = (),
    never: Collection[int] = (),
) -> tuple[Check, ...]:
    """Make the checks of all objects, sorted by index and sub-index.

    What is not described is read too: in every object the sub-indices between and behind
    those described, and FEh and FFh; over all objects together each sub-index up to FFh
    once; behind every row of objects the index that follows.

    Args:
        device: what the EDS says.
        node_id: of the node, 1..127; for defaults with $NODEID.
        allow: indices of the profile area, 6000h to 9FFFh, that may be written.
        never: indices that are never written.
    """
    maker, checks = _Maker(node_id, allow, never), list[Check]()
    entries = sorted(device.entries, key=attrgetter("key"))
    objects = [(index, list(rows)) for index, rows in groupby(entries, attrgetter("index"))]
    for number, (index, rows) in enumerate(objects):
        for entry in rows:
            checks += maker.of_entry(entry, counts=entry.sub == 0 and len(rows) > 1)
        share = range(number % len(objects), HIGHEST_SUB + 1, len(objects))
        checks.append(_absent_subs(index, rows, share))
    checks.append(_absent_objects([index for index, _ in objects]))
    return (*checks, *profile_checks(device, node_id))


def _check(  # noqa: PLR0913, PLR0917 - a check, by its parts
    entry: EntryDescription,
    suffix: str,
    title: str,
    source: str,
    step: Step,
    level: Level = Level.READ_ONLY,
    choice: str = "",
) -> Check:
    where = f"{entry.index:04X}.{entry.sub:02X}"
    name = f"{entry.index:04X}h:{entry.sub:02X} {entry.name}"
    return Check(
        *(f"OD-{where}-{suffix}", GROUP, f"{name}: {title}", source, level),
        *(frozenset(), (step,), choice),
    )


def _holds(entry: EntryDescription, constant: str | None) -> Check:
    """Make the check of what an entry holds."""
    step = _step(entry, constant)
    title = f"holds {entry.data_type.name}"
    if constant is None:
        return _check(entry, "type", title, TYPES, step)
    return _check(entry, "type", f"{title}, its DefaultValue", f"{TYPES}; {DEFAULTS}", step)


def _step(entry: EntryDescription, value: str | None) -> dict[str, object]:
    """Make the step that reads an entry; a value is hexadecimal."""
    step: dict[str, object] = {"holds": _place(entry), "type": entry.data_type.name}
    said = {"low": entry.low, "high": entry.high, "value": value}
    if _may_have_none(entry):
        step |= {"codes": list(NO_VALUE_YET)}
    return step | {key: number for key, number in said.items() if number is not None}


def _refused(
    entry: EntryDescription, suffix: str, title: str, grow: int, codes: Sequence[str]
) -> Check:
    """Make a check that writes what it has read, so many bytes longer: it must be refused."""
    step = {"refuse rewrite": _place(entry), "grow": grow, "codes": _codes(entry, codes)}
    return _check(entry, suffix, title, ABORTS, step, Level.COMMUNICATION)


def _of_sizes(entry: EntryDescription) -> Iterator[Check]:
    if entry.size:
        yield _refused(entry, "long", "a byte too long: refused", 1, TOO_LONG)
    if entry.size > 1:
        yield _refused(entry, "short", "a byte too short: refused", -1, TOO_SHORT)


def _of_limits(entry: EntryDescription) -> Iterator[Check]:
    """Write the numbers just outside of the limits, as far as the data type has them."""
    lowest, highest = entry.data_type.limits
    for suffix, limit, beyond, codes in (
        ("high", entry.high, 1, TOO_HIGH),
        ("low", entry.low, -1, TOO_LOW),
    ):
        if isinstance(limit, int) and lowest <= limit + beyond <= highest:
            data = (limit + beyond).to_bytes(entry.size, "little", signed=entry.signed)
            title = f"{limit + beyond} is beyond its limit {limit}: refused"
            row = {"refuse write": _place(entry), "data": data.hex().upper()}
            step = {**row, "codes": _codes(entry, codes)}
            yield _check(entry, suffix, title, ABORTS, step, Level.COMMUNICATION)


def _codes(entry: EntryDescription, codes: Sequence[str]) -> list[str]:
    """Return the codes with which a write is refused: those of the value, or of what is in use."""
    return [*dict.fromkeys([*codes, *(KEPT if entry.index in IN_USE else ())])]


def _refuse_read(entry: EntryDescription) -> Step:
    return {"refuse read": _place(entry), "codes": list(WRITE_ONLY)}


def _absent_subs(index: int, rows: list[EntryDescription], share: Collection[int]) -> Check:
    """Read sub-indices that are not described."""
    known = {row.sub for row in rows}
    behind = max(known) + 1
    asked = {*range(behind + 1), HIGHEST_SUB - 1, *share} - known
    steps: list[Step] = [
        {"refuse read": f"{index:04X}:{sub:02X}", "codes": list(ABSENT_SUB)}
        for sub in sorted(asked)
        if sub < HIGHEST_SUB
    ]
    if HIGHEST_SUB not in known:
        structure = {"holds": f"{index:04X}:FF", "type": "UNSIGNED32"}
        steps.append({**structure, "codes": list(ABSENT_SUB)})
    name = rows[0].name if len(rows) == 1 else "its sub-indices"
    title = f"{index:04X}h {name}: has no sub-index that is not described"
    level, source = Level.READ_ONLY, ABORTS
    return Check(f"OD-{index:04X}-subs", GROUP, title, source, level, frozenset(), tuple(steps))


def _absent_objects(indices: Collection[int]) -> Check:
    """Read what is behind each row of objects, and in each area the last."""
    ends = (0x1FFF, 0x5FFF, 0x9FFF, 0xFFFF)
    behind = {index + 1 for index in indices if index < 0xFFFF} | set(ends)
    asked = sorted(behind - set(indices) - set(DATA_TYPES))
    steps = tuple(
        {"refuse read": f"{index:04X}:00", "codes": list(ABSENT_OBJECT)} for index in asked
    )
    title = "objects that are not described are not there"
    return Check("OD-absent", GROUP, title, ABORTS, Level.READ_ONLY, frozenset(), steps)


def _place(entry: EntryDescription) -> str:
    return f"{entry.index:04X}:{entry.sub:02X}"


def _is_constant(entry: EntryDescription, counts: bool) -> bool:
    """Return whether an entry always holds its default."""
    if entry.writable or (entry.index, entry.sub) == SERIAL_NUMBER:
        return False
    if Access.CONST in entry.access or entry.index in CONSTANTS:
        return True
    return counts and entry.index not in COUNTS and entry.index in COMMUNICATION_AREA


def _may_have_none(entry: EntryDescription) -> bool:
    """Return whether an entry may hold nothing: no error yet, an empty domain or string."""
    reserved = entry.index in PDO_PARAMETERS and entry.sub == RESERVED_SUB
    return reserved or entry.index == ERROR_FIELD or not entry.size
