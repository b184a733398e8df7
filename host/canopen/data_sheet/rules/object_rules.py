"""Rules over the sections of objects: what each has to say, and how many sub-indices it has."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, EditPlace, RuleFinding
from tickrig.host.canopen.data_sheet.rules.head_rules import number
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_entry import COUNTS, StandardObject, standard_object
from tickrig.wire.canopen.eds.eds_value import object_section
from tickrig.wire.canopen.eds.eds_writer import VARIABLES, entry_lines
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

_LONGEST_NAME: Final = 241
_STRUCTURE: Final = 0xFF
"""The sub-index that tells the structure of an object (CiA 301, 7.4.3)."""
_OF_ELEMENTS: Final = (
    *("DataType", "AccessType", "PDOMapping", "DefaultValue", "LowLimit", "HighLimit"),
)


def names(document: Document) -> Iterator[RuleFinding]:
    """Judge the names of objects and entries."""
    for section, _, _ in document.file.objects():
        name = document.file.value(section, "ParameterName")
        if len(name) > _LONGEST_NAME:
            what = f"ParameterName has {len(name)} characters, {_LONGEST_NAME} were allowed"
            yield document.found("name-length", what, section, "ParameterName")
        elif not name and document.file.has(section, "ParameterName"):
            what = "ParameterName is empty"
            yield document.found("name-empty", what, section, "ParameterName")


def kinds(document: Document) -> Iterator[RuleFinding]:
    """Find objects that do not say what they are, and entries that may or may not be mapped."""
    file = document.file
    for section, index, sub in file.objects():
        described = document.device.objects.get(index)
        if described is None or file.is_xml:
            continue
        composed = sub is None and described.code not in VARIABLES
        if composed and not file.has(section, "ObjectType"):
            line = f"ObjectType=0x{described.code:X}"
            what = f"ObjectType is missing, and there are sub-indices: {line} is taken"
            edit = document.add_to(section, [line])
            yield document.found("object-type-missing", what, section, "", edit)
        if not composed and file.has(section, "DataType") and not file.has(section, "PDOMapping"):
            what = "PDOMapping is missing: 0 is taken"
            yield document.found("pdo-mapping-missing", what, section)


def sub_numbers(document: Document) -> Iterator[RuleFinding]:
    """Hold SubNumber against the sub-indices that are there; what is missing is not hidden."""
    file = document.file
    for section, index, sub in file.objects():
        described = document.device.objects.get(index)
        if sub is not None or described is None or number(document, section, "CompactSubObj"):
            continue
        present, line = len(document.subs(index)), document.keyword(section, "SubNumber")
        said = number(document, section, "SubNumber")
        if line is None and present:
            what = f"SubNumber is missing, there are {present} sub-indices"
            edit = document.add_to(section, [f"SubNumber={present}"])
            yield document.found("sub-number", what, section, "", edit)
        elif line is not None and said not in (present, None):
            what = f"SubNumber={said}, but there are {present} sub-indices"
            lost = said > present and not _is_whole(document, section, index)
            edits = () if file.is_xml or lost else (document.with_value(line, str(present)),)
            yield document.found("sub-number", what, section, "SubNumber", *edits)


def _is_whole(document: Document, section: str, index: int) -> bool:
    """Return whether all but SubNumber agrees that no sub-index is missing."""
    if document.device.objects[index].code in VARIABLES:
        return document.file.has(section, "ObjectType")
    subs, row = sorted(document.subs(index)), document.rows.get((index, 0))
    if row is None or not row.has_default or index in COUNTS:
        return False
    return subs == list(range(len(subs))) and row.default[:1] == bytes([len(subs) - 1])


def sub_zeros(document: Document) -> Iterator[RuleFinding]:
    """Judge the sub-index 0 of arrays and records."""
    for index, described in document.device.objects.items():
        if described.code in VARIABLES:
            continue
        head, row = f"{index:04X}", document.rows.get((index, 0))
        if row is None:
            yield document.found("sub0-missing", "there is no sub-index 0", head)
            continue
        section = f"{head}sub0"
        if row.data_type is not DataType.UNSIGNED8:
            what = f"its DataType is {row.data_type.name}, UNSIGNED8 was allowed"
            yield document.found("sub0-type", what, section, "DataType")
        elif row.has_default and index not in COUNTS and Access.WRITE not in row.access:
            yield from _highest(document, index, section, row.default[0])


def _highest(document: Document, index: int, section: str, said: int) -> Iterator[RuleFinding]:
    subs = [row.sub for row in document.entries(index) if row.sub != _STRUCTURE]
    line = document.keyword(section, "DefaultValue")
    if said == max(subs) or section not in document.file.sections:
        return
    what = f"its default is {said}, the highest sub-index is {max(subs)}"
    edits: tuple[Edit, ...] = ()
    if line is not None and said < max(subs) and not document.file.is_xml:
        edits = (document.with_value(line, str(max(subs))),)
    yield document.found("sub0-value", what, section, "DefaultValue", *edits)


def _section_of(row: EntryDescription) -> Iterator[str]:
    """Give the section of an entry; without a default where it has none."""
    yield ""
    for line in entry_lines(row):
        yield "DefaultValue=" if line.startswith("DefaultValue=") and not row.has_default else line


def compact_edits(document: Document, section: str) -> tuple[Edit, ...]:
    """Return what writes each entry of a compact object as a section of its own."""
    place = object_section(section)
    known = all(document.file.value(section, key) for key in ("DataType", "AccessType"))
    if place is None or document.file.is_xml or not known:
        return ()
    index, _ = place
    rows = document.entries(index)
    told = set(document.subs(index))
    try:
        texts = [text for row in rows if row.sub not in told for text in _section_of(row)]
    except ValueError:  # a name with control characters, which are mended first
        return ()
    edits = [
        Edit(line.number)
        for key in (*_OF_ELEMENTS, "SubNumber")
        if (line := document.keyword(section, key)) is not None
    ]
    for beside in (f"{section}Name", f"{section}Value"):
        lines = document.lines_of(beside)
        edits += [Edit(line.number) for line in lines]
        if beside in document.file.sections:
            edits.append(Edit(document.file.line(beside)))
    count = document.keyword(section, "CompactSubObj")
    if count is not None:
        edits.append(Edit(count.number, lines=(f"SubNumber={len(rows)}",)))
    after = document.add_to(section, texts)
    return (*edits, Edit(after.line, EditPlace.AFTER, after.lines))


# Rules over what the standards want to be there: communication area, profiles.

_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_DEVICE_TYPE: Final = (0x1000, 0)
_IDENTITY: Final = 0x1018
_COMMUNICATION: Final = range(0x1000, 0x2000)
_WRITE_ONLY: Final = (0x1024, 0x1026, *range(0x1F50, 0x1F60))
"""Objects that take what they need not give back: commands, programs."""
_PROFILE_AREA: Final = range(0x6000, 0xA000)
_TEXTS: Final = (
    *(DataType.VISIBLE_STRING, DataType.UNICODE_STRING, DataType.OCTET_STRING, DataType.DOMAIN),
)
"""Data types whose values are as long as they are."""
_INPUTS_OUTPUTS: Final = (
    (1 << 16, "digital inputs", (0x6000, 0x6020, 0x6100, 0x6120)),
    (1 << 17, "digital outputs", (0x6200, 0x6220, 0x6300, 0x6320)),
    (1 << 18, "analogue inputs", (0x6400, 0x6401, 0x6402, 0x6403, 0x6404)),
    (1 << 19, "analogue outputs", (0x6410, 0x6411, 0x6412, 0x6413, 0x6414)),
)
_DRIVE: Final = (0x6040, 0x6041)
_IO_PROFILE: Final = 401
_DRIVE_PROFILE: Final = 402
_MANY_AXES: Final = 0x800
_GUESSED: Final = (
    *("data-type-missing", "data-type-unknown", "empty-value", "no-number"),
    *("access-missing", "access-form"),
)
"""Where one of these is found, the reader has taken something that nobody wrote."""


def mandatory(document: Document) -> Iterator[RuleFinding]:
    """Find what each CANopen device has, and this one has not."""
    objects = document.device.objects
    if not objects:
        return
    for index in _MANDATORY:
        if index not in objects:
            yield document.found("mandatory-missing", f"there is no {index:04X}h")
    if _IDENTITY in objects and (_IDENTITY, 1) not in document.rows:
        what = "there is no 1018h:01 (vendor-ID)"
        yield document.found("mandatory-missing", what, f"{_IDENTITY:04X}")
    if 0x1017 not in objects and 0x100C not in objects:
        what = "there is no 1017h (heartbeat) and no 100Ch (node guarding)"
        yield document.found("error-control", what)


def communication(document: Document) -> Iterator[RuleFinding]:
    """Hold the objects of the communication area against CiA 301."""
    for index, described in document.device.objects.items():
        standard = standard_object(index)
        if standard is not None and standard.composed == (described.code in VARIABLES):
            kind = "an ARRAY or RECORD" if standard.composed else "a VAR"
            what = f"it is a {described.code.name}, {kind} was allowed"
            yield document.found("communication-kind", what, f"{index:04X}", "ObjectType")
    file = document.file
    findings = (*file.errors, *file.warnings)
    guessed = {(one.section, one.line) for one in findings if one.rule in _GUESSED}
    for row in document.rows.values():
        if row.index in _COMMUNICATION:
            found = _entry(document, row, standard_object(row.index))
            yield from (one for one in found if (one.section, one.line) not in guessed)


def _entry(
    document: Document, row: EntryDescription, standard: StandardObject | None
) -> Iterator[RuleFinding]:
    place = f"{row.index:04X}sub{row.sub:X}"
    if place not in document.file.sections:
        place = f"{row.index:04X}"
    if standard is not None and (row.sub == 0 or standard.composed):
        wanted = standard.types.get(row.sub, standard.others)
        both_texts = wanted in _TEXTS and row.data_type in _TEXTS
        if wanted not in (None, row.data_type) and not both_texts and _is_composed(document, row):
            what = f"its DataType is {row.data_type.name}, {wanted.name} was allowed"
            yield document.found("communication-type", what, place, "DataType")
    if Access.WRITE in row.access and standard is not None and standard.fixed:
        what = "the bus may write it, reading was allowed"
        yield document.found("communication-access", what, place, "AccessType")
    elif Access.READ not in row.access and row.index not in _WRITE_ONLY and standard is not None:
        what = "the bus may not read it"
        yield document.found("communication-access", what, place, "AccessType")


def _is_composed(document: Document, row: EntryDescription) -> bool:
    """Return whether an object has the kind that its types are known for."""
    standard, described = standard_object(row.index), document.device.objects[row.index]
    return standard is not None and standard.composed == (described.code not in VARIABLES)


def profile(document: Document) -> Iterator[RuleFinding]:
    """Hold the device type against the objects of the profile."""
    row, objects = document.rows.get(_DEVICE_TYPE), document.device.objects
    if row is None or row.data_type is not DataType.UNSIGNED32:
        return
    if not row.has_default:
        drive = ", but 6040h and 6041h of a drive" if set(_DRIVE) <= objects.keys() else ""
        text = f"1000h has no value: no profile{drive}"
        yield document.found("device-type-missing", text, "1000")
        return
    device_type = int.from_bytes(row.default, "little")
    number, more = device_type & 0xFFFF, device_type & 0xFFFF_0000
    if number == _IO_PROFILE:
        for flag, what, some in _INPUTS_OUTPUTS:
            if more & flag and not any(index in objects for index in some):
                text = f"it promises {what}, but there is none of {some[0]:04X}h to {some[-1]:04X}h"
                yield document.found("profile-objects", text, "1000", "DefaultValue")
    elif number == _DRIVE_PROFILE:
        for index in _DRIVE:
            if not any(index + axis * _MANY_AXES in objects for axis in range(8)):
                text = f"it is a drive, but there is no {index:04X}h"
                yield document.found("profile-objects", text, "1000", "DefaultValue")
    elif number == 0 and any(index in _PROFILE_AREA for index in objects):
        text = "it has no profile, but objects of 6000h to 9FFFh"
        yield document.found("profile-none", text, "1000", "DefaultValue")
