"""Rules for the three lists of objects. Each object is in one list, and numbers start at 1.

The description of a listed object may have been lost. Therefore a listed object without a
description stays in its list, and no count is lowered.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, EditPlace, RuleFinding
from tickrig.host.canopen.eds import eds_number
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.eds.eds_value import EdsLine

_MANDATORY: Final = "MandatoryObjects"
_OPTIONAL: Final = "OptionalObjects"
_MANUFACTURER: Final = "ManufacturerObjects"
LISTS: Final = (_MANDATORY, _OPTIONAL, _MANUFACTURER)
_ALWAYS_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_MANUFACTURER_AREA: Final = range(0x2000, 0x6000)
_NUMBER: Final = re.compile(r"[0-9]{1,5}", re.ASCII)
_INDICES: Final = range(0x1000, 0x10000)


class ObjectList:
    """List of objects in an EDS: mandatory, optional or manufacturer-specific objects.

    Attributes:
        title: title of the section that contains the list.
        entries: each line of the list with its object index. The index is None if the value is not
            an index.
    """

    def __init__(self, document: Document, title: str) -> None:
        self.title = title
        self.entries: list[tuple[EdsLine, int | None]] = []
        for line in document.lines_of(title):
            if _NUMBER.fullmatch(line.key) and line.value:
                self.entries.append((line, _index(line.value)))

    @property
    def indices(self) -> list[int]:
        """The valid indices of the list."""
        return [index for _, index in self.entries if index is not None]


def _index(text: str) -> int | None:
    number = eds_number(text)
    return number if number in range(0x1_0000) else None


def _home(index: int) -> str:
    """Return the list to which an object belongs.

    >>> _home(0x1018), _home(0x2000), _home(0x6000)
    ('MandatoryObjects', 'ManufacturerObjects', 'OptionalObjects')
    """
    if index in _ALWAYS_MANDATORY:
        return _MANDATORY
    return _MANUFACTURER if index in _MANUFACTURER_AREA else _OPTIONAL


def described(document: Document) -> set[int]:
    """Return the objects that have a section and belong in a list."""
    return {index for _, index, sub in document.file.objects() if sub is None and index in _INDICES}


def are_whole(document: Document) -> bool:
    """Return whether the lists exist, are complete, and name only described objects."""
    if _OPTIONAL not in document.file.sections:
        return False
    found = [ObjectList(document, title) for title in LISTS if title in document.file.sections]
    listed = {index for each in found for index in each.indices}
    return listed <= described(document) and all(
        (_index(document.file.value(each.title, "SupportedObjects")) or 0) <= len(each.entries)
        for each in found
    )


def lists(document: Document) -> Iterator[RuleFinding]:
    """Check the three lists. Each finding fixes a whole list."""
    found = [ObjectList(document, title) for title in LISTS]
    present = described(document)
    listed = {index for each in found for index in each.indices}
    for index in sorted(present - listed):
        title = _home(index)
        what = f"{index:04X}h is not in any list; expected {title}"
        edits = _mended(document, found, title, present)
        yield document.found("list-missing", what, f"{index:04X}", "", *edits)
    seen: set[int] = set()
    for each in found:
        edits = _mended(document, found, each.title, present)
        for rule, what, line in _faults(document, each, present, seen):
            mends = edits if rule != "list-extra" else ()
            yield document.found(rule, what, each.title, line, *mends)


def _faults(
    document: Document, each: ObjectList, present: set[int], seen: set[int]
) -> Iterator[tuple[str, str, int | str]]:
    """Yield rule, text and line of each fault of a list."""
    if each.title not in document.file.sections:
        return
    for line, index in each.entries:
        if index is None or index not in _INDICES:
            yield "list-entry", f"{shorten(line.content)} is not an index", line.number
            continue
        if index not in present:
            yield "list-extra", f"{index:04X}h has no section", line.number
        elif index in seen:
            yield "list-doubled", f"{index:04X}h is listed twice", line.number
        elif _is_wrong(each.title, index):
            what = f"{index:04X}h is in {each.title}; expected {_home(index)}"
            yield "list-wrong", what, line.number
        seen.add(index)
    numbers = [int(line.key) for line, _ in each.entries]
    if sorted(numbers) != list(range(1, len(numbers) + 1)):
        yield "list-gap", f"its numbers are not 1 to {len(numbers)}", ""
    said = document.file.value(each.title, "SupportedObjects")
    if _index(said) != len(numbers):
        what = f"SupportedObjects={shorten(said)}, but {len(numbers)} are listed"
        yield "list-count", what, "SupportedObjects"


def _is_wrong(title: str, index: int) -> bool:
    """Return whether an object is in the wrong list. Profiles define mandatory objects too."""
    if title == _MANDATORY:
        return _home(index) == _MANUFACTURER
    return title != _home(index)


def _mended(
    document: Document, found: list[ObjectList], title: str, present: set[int]
) -> tuple[Edit, ...]:
    """Return the edits that correct a list. Another list has its own finding."""
    each = next(one for one in found if one.title == title)
    if title not in document.file.sections:
        added = "", f"[{title}]", "SupportedObjects=0"
        return (Edit(len(document.texts), EditPlace.AFTER, added),)
    listed = {index for one in found for index in one.indices if not _is_wrong(one.title, index)}
    wanted = list(
        dict.fromkeys(
            index
            for index in each.indices
            if index in _INDICES and not (index in present and _is_wrong(title, index))
        )
    )
    earlier = {index for one in found[: found.index(each)] for index in one.indices}
    wanted = [index for index in wanted if index not in earlier or _home(index) == title]
    wanted += sorted(index for index in present - listed if _home(index) == title)
    return tuple(_rewritten(document, each, wanted))


def _may_be_set(said: int | None, listed: int, wanted: int) -> bool:
    """Return whether a count is wrong but does not indicate lost entries."""
    return said is None or (said != wanted and (said <= listed or said < wanted))


def _rewritten(document: Document, each: ObjectList, wanted: list[int]) -> Iterator[Edit]:
    """Yield the edits for the lines of a list that change."""
    lines = [line for line, _ in each.entries]
    for at, index in enumerate(wanted[: len(lines)]):
        if (lines[at].key, each.entries[at][1]) != (str(at + 1), index):
            yield Edit(lines[at].number, lines=(f"{at + 1}=0x{index:04X}",))
    for line in lines[len(wanted) :]:
        yield Edit(line.number)
    added = [f"{at}=0x{index:04X}" for at, index in enumerate(wanted, 1) if at > len(lines)]
    head = document.keyword(each.title, "SupportedObjects")
    if head is None:
        added.insert(0, f"SupportedObjects={len(wanted)}")
    elif _may_be_set(_index(head.value), len(lines), len(wanted)):
        yield document.with_value(head, str(len(wanted)))
    if added:
        yield document.add_to(each.title, added)
