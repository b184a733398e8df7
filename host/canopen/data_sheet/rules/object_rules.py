"""Rules for the sections of objects: mandatory keywords, and number of sub-indices."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, EditPlace, RuleFinding
from tickrig.host.canopen.data_sheet.rules.head_rules import number
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_entry import COUNTS
from tickrig.wire.canopen.eds.eds_value import object_section
from tickrig.wire.canopen.eds.eds_writer import VARIABLES, entry_lines
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

_LONGEST_NAME: Final = 241
_STRUCTURE: Final = 0xFF
"""The sub-index that holds the structure of an object (CiA 301, 7.4.3)."""
_OF_ELEMENTS: Final = (
    *("DataType", "AccessType", "PDOMapping", "DefaultValue", "LowLimit", "HighLimit"),
)


def names(document: Document) -> Iterator[RuleFinding]:
    """Check the names of objects and entries."""
    for section, _, _ in document.file.objects():
        name = document.file.value(section, "ParameterName")
        if len(name) > _LONGEST_NAME:
            what = f"ParameterName has {len(name)} characters, {_LONGEST_NAME} were allowed"
            yield document.found("name-length", what, section, "ParameterName")
        elif not name and document.file.has(section, "ParameterName"):
            what = "ParameterName is empty"
            yield document.found("name-empty", what, section, "ParameterName")


def kinds(document: Document) -> Iterator[RuleFinding]:
    """Find objects without an ObjectType, and entries without PDOMapping."""
    file = document.file
    for section, index, sub in file.objects():
        described = document.device.objects.get(index)
        if described is None:
            continue
        composed = sub is None and described.code not in VARIABLES
        if composed and not file.has(section, "ObjectType"):
            line = f"ObjectType=0x{described.code:X}"
            what = f"ObjectType is missing, but there are sub-indices: {line} is taken"
            edit = document.add_to(section, [line])
            yield document.found("object-type-missing", what, section, "", edit)
        if not composed and file.has(section, "DataType") and not file.has(section, "PDOMapping"):
            what = "PDOMapping is missing: 0 is taken"
            yield document.found("pdo-mapping-missing", what, section)


def sub_numbers(document: Document) -> Iterator[RuleFinding]:
    """Find objects whose SubNumber differs from the number of their sub-index sections.

    Each finding contains an edit that corrects SubNumber. If a sub-index seems to be missing, the
    finding contains no edit, so that the error stays visible.
    """
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
            edits = () if lost else (document.with_value(line, str(present)),)
            yield document.found("sub-number", what, section, "SubNumber", *edits)


def _is_whole(document: Document, section: str, index: int) -> bool:
    """Return whether everything except SubNumber indicates that no sub-index is missing."""
    if document.device.objects[index].code in VARIABLES:
        return document.file.has(section, "ObjectType")
    subs, row = sorted(document.subs(index)), document.rows.get((index, 0))
    if row is None or not row.has_default or index in COUNTS:
        return False
    return subs == list(range(len(subs))) and row.default[:1] == bytes([len(subs) - 1])


def sub_zeros(document: Document) -> Iterator[RuleFinding]:
    """Check sub-index 0 of arrays and records."""
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
    if line is not None and said < max(subs):
        edits = (document.with_value(line, str(max(subs))),)
    yield document.found("sub0-value", what, section, "DefaultValue", *edits)


def _section_of(row: EntryDescription) -> Iterator[str]:
    """Yield the section of an entry. DefaultValue is omitted if the entry has no default."""
    yield ""
    for line in entry_lines(row):
        yield "DefaultValue=" if line.startswith("DefaultValue=") and not row.has_default else line


def compact_edits(document: Document, section: str) -> tuple[Edit, ...]:
    """Return the edits that replace CompactSubObj of an object by one section per sub-index."""
    place = object_section(section)
    known = all(document.file.value(section, key) for key in ("DataType", "AccessType"))
    if place is None or not known:
        return ()
    index, _ = place
    rows = document.entries(index)
    told = set(document.subs(index))
    try:
        texts = [text for row in rows if row.sub not in told for text in _section_of(row)]
    except ValueError:  # a name with control characters, which are fixed first
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
