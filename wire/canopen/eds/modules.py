"""The objects that the connected modules of a modular device add (CiA 306-1, modular devices)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from tickrig.wire.canopen.eds.eds_entry import (
    HIGHEST_SUB,
    count_of,
    object_kind,
    read_entry,
    read_object,
)
from tickrig.wire.canopen.eds.eds_file import EdsFile, shorten
from tickrig.wire.canopen.eds.eds_value import parse_number, plain_numbers
from tickrig.wire.canopen.eds.eds_writer import VARIABLES
from tickrig.wire.canopen.eds.object_table import EntryDescription, ObjectCode, ObjectDescription

SUPPORTED: Final = "SupportedModules"
CONNECTED: Final = "ConnectedModules"
MODULE_LIST: Final = 0x1027
HIGHEST_INDEX: Final = 0xFFFF

Added = tuple[ObjectDescription, list[EntryDescription]]
Objects = Mapping[int, ObjectDescription]


def module_objects(
    file: EdsFile, entries: Iterable[EntryDescription], objects: Objects
) -> Iterator[Added]:
    """Give the objects of the modules that a DCF connects, and the list of them (1027h).

    A fixed object is there once, however many modules have it. A sub-index extension adds
    sub-indices in the order of the modules, and goes on in the next object behind the sub-index
    that ObjExtend gives. What the file describes itself, as a DCF may, stays as it is.

    Args:
        file: takes what is wrong: modules that are not described, or none that is connected.
        entries: those that the file describes.
        objects: their names and kinds.

    Returns:
        Name and kind of each object, and all of its entries.
    """
    if CONNECTED not in file.sections:
        if file.number(SUPPORTED, "NrOfEntries"):
            reason = (
                "a modular device: the objects of its modules are left out, for"
                f" [{CONNECTED}] of a DCF has to say which are there"
            )
            file.warn(SUPPORTED, reason, "modules")
        return
    rows = list(entries)
    modules = _numbers(file, CONNECTED)
    for module in dict.fromkeys(modules):
        kinds = ("ModuleInfo", "FixedObjects", "SubExtends")
        if not any(f"M{module}{kind}" in file.sections for kind in kinds):
            _missing(file, CONNECTED, f"M{module}ModuleInfo")
    yield from _listed(modules, rows, objects)
    yield from _fixed(file, modules)
    whole = {row.index for row in rows if row.sub or objects[row.index].code in VARIABLES}
    for index, sections in _extensions(file, modules).items():
        if index not in whole:
            yield from _extended(file, index, sections, objects)


def _missing(file: EdsFile, section: str, wanted: str) -> None:
    reason = f"there is no [{wanted}]: what it would add is left out"
    file.warn(section, reason, "modules")


def _numbers(file: EdsFile, section: str) -> list[int]:
    """Return the numbers of a list, in its order; 0 is none."""
    keys = (key for key in file.sections.get(section, {}) if key.isascii() and key.isdigit())
    found = (file.number(section, key) for key in sorted(keys, key=int))
    return [number for number in found if number]


def _listed(
    modules: list[int], rows: Iterable[EntryDescription], objects: Objects
) -> Iterator[Added]:
    """Give 1027h with the numbers of the modules, where the file leaves them open."""
    own = [row for row in rows if row.index == MODULE_LIST]
    if own:
        count = min(len(modules), max(row.sub for row in own))
        values = dict(enumerate([count, *modules]))
        filled = (
            row if row.has_default or not row.data_type.is_integer else _filled(row, values)
            for row in own
        )
        yield objects[MODULE_LIST], list(filled)


def _filled(row: EntryDescription, values: Mapping[int, int]) -> EntryDescription:
    value = values.get(row.sub, 0)
    low, high = row.data_type.limits
    return row.with_default(value) if low <= value <= high else row


def _fixed(file: EdsFile, modules: list[int]) -> Iterator[Added]:
    """Give the fixed objects of modules."""
    seen: set[int] = set()
    for module in dict.fromkeys(modules):
        listing = f"M{module}FixedObjects"
        for index in _numbers(file, listing):
            head = f"M{module}Fixed{index:04X}"
            if index in seen or f"{index:04X}" in file.sections or index > HIGHEST_INDEX:
                continue
            if head not in file.sections:
                _missing(file, listing, head)
                continue
            seen.add(index)
            subs = [(f"{head}sub{sub:X}", sub) for sub in range(0x100)]
            subs = [each for each in subs if each[0] in file.sections]
            kind = object_kind(file, head, bool(subs))
            rows = [] if kind is None else list(read_object(file, head, index, kind, subs))
            if kind is not None and rows:
                yield ObjectDescription(file.value(head, "ParameterName"), kind), rows


def _extensions(file: EdsFile, modules: list[int]) -> dict[int, list[str]]:
    """Return the sections that extend objects, each as often as its module is there, by index."""
    found: dict[int, list[str]] = {}
    for module in modules:
        listing = f"M{module}SubExtends"
        for index in _numbers(file, listing):
            section = f"M{module}SubExt{index:04X}"
            if section in file.sections and index <= HIGHEST_INDEX:
                found.setdefault(index, []).append(section)
            else:
                _missing(file, listing, section)
    return found


def _extended(file: EdsFile, index: int, sections: list[str], objects: Objects) -> Iterator[Added]:
    """Give an object with the sub-indices that modules add, and those that it goes on in."""
    rows: list[EntryDescription] = []
    free_bits = 0
    for section in sections:
        count, bits = _count(file, section)
        width = max(read_entry(file, section, index, 1, "").data_type.bits, 1)
        if bits:
            count = max(-((free_bits - bits) // width), 0)
            free_bits += count * width - bits
        last = min(file.number(section, "ObjExtend"), HIGHEST_SUB)
        for _ in range(count):
            if len(rows) >= (last or HIGHEST_SUB):
                if not last or index >= HIGHEST_INDEX or index + 1 in objects:
                    reason = f"{index:04X}h has no sub-index free: what it adds is left out"
                    file.warn(section, reason, "modules")
                    break
                yield _object(file, index, rows, objects, section)
                index, rows = index + 1, []
            sub = len(rows) + 1
            name = f"{file.value(section, 'ParameterName')}{sub}"
            rows.append(read_entry(file, section, index, sub, name))
    yield _object(file, index, rows, objects, sections[0])


def _object(
    file: EdsFile, index: int, rows: list[EntryDescription], objects: Objects, section: str
) -> Added:
    usual = ObjectDescription(file.value(section, "ParameterName"), ObjectCode.ARRAY)
    return objects.get(index, usual), [count_of(index, rows), *rows]


def _count(file: EdsFile, section: str) -> tuple[int, int]:
    """Return how many sub-indices a module adds, or how many bits of one (`0;2`)."""
    text = file.value(section, "Count")
    whole, _, bits = text.partition(";")
    try:
        count = parse_number(plain_numbers(whole.strip()))
        part = 0 if count else parse_number(plain_numbers(bits.strip()))
        if 0 <= count <= HIGHEST_SUB and 0 <= part <= HIGHEST_SUB and (count or part):
            return count, part
    except ValueError:
        pass
    reason = f"Count={shorten(text)} is not N, or 0;BITS, of at most {HIGHEST_SUB}: 1 is taken"
    file.warn(section, reason, "no-number", "Count")
    return 1, 0
