"""The rule that detects a truncated file by missing objects."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.canopen.data_sheet.rules.head_rules import number
from tickrig.host.canopen.data_sheet.rules.list_rules import LISTS, ObjectList, described
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.eds.eds_value import object_section

_SIGNS: Final = 2
"""Number of signs that prove a truncation.

A single sign may be a slip, such as one missing object.
"""


def truncated(document: Document) -> Iterator[RuleFinding]:
    """Find a file that ends before everything that the file announces."""
    lines = [line for line in document.file.lines if line.content]
    if not lines:
        return
    last = lines[-1].section
    lost = _listed_behind(document, last)
    signs = len(lost) + (document.texts[-1] != "") + _is_short(document, last)
    if signs >= _SIGNS and (lost or _is_short(document, last)):
        rest = f"; {lost[0]:04X}h and {len(lost) - 1} more are listed" if lost else ""
        what = f"the file looks truncated: it ends in [{shorten(last)}]{rest}"
        yield document.found("truncated", what, "", lines[-1].number)


def _listed_behind(document: Document, last: str) -> list[int]:
    """Return the listed objects without a section, if they come after the last section."""
    place, present = object_section(last), described(document)
    listed = [index for title in LISTS for index in ObjectList(document, title).indices]
    for order in (listed, sorted(listed)):
        lost = [index for index in order if index not in present]
        begun = order[: len(order) - len(lost)]
        follows = place is None or not begun or begun[-1] == place[0]
        if order[len(begun) :] == lost and follows:
            return lost
    return []


def _is_short(document: Document, last: str) -> int:
    """Count the missing parts of the last section: entries, entries of the object, and keywords."""
    if last in LISTS:
        said = number(document, last, "SupportedObjects") or 0
        return int(said > len(ObjectList(document, last).entries))
    place = object_section(last)
    if place is None:
        return 0
    said = number(document, f"{place[0]:04X}", "SubNumber") or 0
    has_all = document.file.has(last, "AccessType") or place[1] is None
    return int(said > len(document.subs(place[0]))) + (not has_all)
