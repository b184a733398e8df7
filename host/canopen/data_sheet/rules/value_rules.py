"""Rules for values (numbers, node-IDs, defaults, limits), and fixes for findings of the reader."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import takewhile
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, RuleFinding
from tickrig.host.canopen.data_sheet.rules.known_keys import is_number
from tickrig.host.canopen.data_sheet.rules.object_rules import compact_edits
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds import eds_value
from tickrig.wire.canopen.eds.eds_entry import LONE_LETTERS
from tickrig.wire.canopen.eds.eds_file import Finding, shorten
from tickrig.wire.canopen.eds.object_table import EntryDescription, ObjectCode

_OCTAL: Final = re.compile(r"0[0-7]{0,20}[1-7][0-7]{0,20}", re.ASCII)
_CANDIDATE: Final = re.compile(r"\b0[0-9]|nodeid", re.IGNORECASE)
_NODE_ID: Final = re.compile(r"\$NODEID(\+(0x[0-9A-F]+|[0-9]+))?", re.IGNORECASE | re.ASCII)
_NUMBERS: Final = frozenset(
    kind for kind in DataType if kind.is_integer or kind in (*eds_value.FLOATS, *eds_value.TIMES)
)
"""Data types whose values are numbers."""
_VALUES: Final = frozenset({"defaultvalue", "lowlimit", "highlimit", "parametervalue"})
_NUMBERED: Final = re.compile(r"(line)?0+([1-9][0-9]*)", re.IGNORECASE | re.ASCII)
"""Keywords of lists that are written with leading zeros."""
_OF_ELEMENTS: Final = re.compile(r"([0-9A-F]{4})(Value|Name|Denotation)")


def numbers(document: Document) -> Iterator[RuleFinding]:
    """Find unusual notations of `$NODEID`, and numbers such as 010.

    Some programs read 010 as an octal number, and others as a decimal number.
    """
    for line in document.file.lines:
        if not _CANDIDATE.search(line.value):  # most lines have none
            continue
        if not line.is_keyword or document.keyword(line.section, line.key) is not line:
            continue
        kind = kind_of(document, line)
        if kind is None and not is_number(line.section, line.key):
            continue
        if line.section == "FileInfo" or (document.file.is_xml and line.key == "ObjFlags"):
            continue  # `file_info` checks the form of a version; flags in XML are hexadecimal
        terms = eds_value.without_comment(line.value).replace(" ", "").split("+")
        if any(_OCTAL.fullmatch(term) for term in terms) and (kind is None or kind.is_integer):
            yield _leading_zero(document, line, terms)
        elif kind is not None and kind.is_integer and "nodeid" in line.value.lower():
            yield from _node_id(document, line.section, line)


def list_numbers(document: Document) -> Iterator[RuleFinding]:
    """Find numbered keywords with leading zeros, which other readers do not find."""
    for line in document.file.lines:
        zeros = _NUMBERED.fullmatch(line.key) if line.is_keyword else None
        if zeros is None or eds_value.object_section(line.section) is not None:
            continue
        spelled = f"{zeros[1] or ''}{zeros[2]}"
        text = document.texts[line.number - 1].replace(line.key, spelled, 1)
        what = f"{shorten(line.key)} stands for {spelled}"
        edit = Edit(line.number, lines=(text,))
        yield document.found("leading-zero", what, line.section, line.number, edit)


def kind_of(document: Document, line: eds_value.EdsLine) -> DataType | None:
    """Return the data type of the object to which a line such as `DefaultValue=5` gives a value.

    The result is None if the line gives no value to an object, or if the data type is not a number.
    """
    of_elements = _OF_ELEMENTS.fullmatch(line.section)
    place = eds_value.object_section(line.section)
    if of_elements is not None and of_elements[2] == "Value" and line.key.isdecimal():
        at = int(of_elements[1], 16), int(line.key)
    elif place is not None and line.key.lower() in _VALUES:
        compact = place[1] is None and document.file.has(line.section, "CompactSubObj")
        at = place[0], int(compact) if place[1] is None else place[1]
    else:
        return None
    row = document.rows.get(at)
    return row.data_type if row is not None and row.data_type in _NUMBERS else None


def _leading_zero(document: Document, line: eds_value.EdsLine, terms: list[str]) -> RuleFinding:
    """Check a number or a sum with the node-ID. Fix a value that is a number in both readings."""
    octal = [term for term in terms if _OCTAL.fullmatch(term)]
    first = octal[0]
    what = f"{shorten(line.content)} is {int(first, 8)} in octal, {int(first)} in decimal"
    if len(terms) > 1:
        what = f"{shorten(line.content)}: {what.partition(' is ')[2]}"
    edits: tuple[Edit, ...] = ()
    if all(int(term, 8) == int(term) for term in octal):
        plain = "+".join(str(int(term)) if term in octal else term for term in terms)
        said = eds_value.without_comment(line.value)
        edits = (document.with_value(line, line.value.replace(said, plain, 1)),)
    return document.found("leading-zero", what, line.section, line.number, *edits)


def _node_id(document: Document, section: str, line: eds_value.EdsLine) -> Iterator[RuleFinding]:
    """Check the number that is added to the node-ID. Blanks are not fixed."""
    plain = line.value.replace(" ", "")
    if _NODE_ID.fullmatch(plain) and plain.startswith("$NODEID"):
        return
    terms = plain.upper().split("+")
    others = [
        eds_value.plain_numbers(term.replace("0X", "0x"))
        for term in terms
        if term not in eds_value.NODE_IDS
    ]
    mended = "+".join(("$NODEID", *others))
    edits: tuple[Edit, ...] = ()
    if len(others) == len(terms) - 1 and _NODE_ID.fullmatch(mended) and not document.file.is_xml:
        edits = (document.with_value(line, mended),)
    what = f"{shorten(line.content)} is not $NODEID or $NODEID+NUMBER"
    if edits:
        what += f": use {mended}"
    yield document.found("nodeid-form", what, section, line.number, *edits)


def limits(document: Document) -> Iterator[RuleFinding]:
    """Compare defaults with limits, and limits with the data type."""
    for row in document.rows.values():
        section = f"{row.index:04X}"
        if section not in document.file.sections or document.subs(row.index):
            section = f"{section}sub{row.sub:X}"
        for key in ("LowLimit", "HighLimit"):
            if text := document.file.value(section, key):
                yield from _limit(document, section, key, text, row)
        yield from _default(document, section, row)


def _limit(
    document: Document, section: str, key: str, text: str, row: EntryDescription
) -> Iterator[RuleFinding]:
    kind = row.data_type
    if not kind.is_integer and kind not in (DataType.REAL32, DataType.REAL64):
        what = f"{key}={shorten(text)} of a {kind.name}"
        yield document.found("limit-type", what, section, key)
    elif kind.is_integer and kind is not DataType.BOOLEAN:
        try:
            limit = eds_value.parse_limit(kind, eds_value.plain_numbers(text))
        except (ValueError, OverflowError):
            return
        lowest, highest = kind.limits
        if limit is not None and not lowest <= limit <= highest:
            what = f"{key}={shorten(text)} is not a valid {kind.name}"
            yield document.found("limit-range", what, section, key)


def _default(document: Document, section: str, row: EntryDescription) -> Iterator[RuleFinding]:
    value = row.data_type.decode(row.default) if row.has_default else None
    if not isinstance(value, int | float) or row.relative:
        return
    low, high = row.low, row.high
    if (low is not None and value < low) or (high is not None and value > high):
        what = f"the default {value} is not in {_text(low)}..{_text(high)}"
        yield document.found("default-limits", what, section, "DefaultValue")


def _text(limit: int | float | None) -> str:
    return "" if limit is None else str(limit)


def of_reader(document: Document) -> Iterator[RuleFinding]:
    """Yield the findings of the EDS reader, with the edits that fix them."""
    file = document.file
    by_line = {line.number: line for line in file.lines}
    for finding in (*file.errors, *file.warnings):
        if finding.rule in _OF_LINES:
            continue
        line, mend = by_line.get(finding.line), _MENDS.get(finding.rule)
        edits: tuple[Edit, ...] = ()
        if mend is not None and line is not None and not file.is_xml:
            edits = mend(document, finding, line)
        if finding.rule == "doubled-key" and line is not None and document.is_again(line):
            continue  # reported for the section
        text = finding.reason
        if finding.rule == "doubled-section" and line is not None:
            text = _doubled_text(document, line)
        elif finding.rule in _OF_ONE_ENTRY and _is_compact_record(document, finding.section):
            text += "; rather than adding it, describe each entry of the RECORD"
        yield document.found(finding.rule, text, finding.section, finding.line, *edits)


def _is_compact_record(document: Document, section: str) -> bool:
    place = eds_value.object_section(section)
    described = document.device.objects.get(place[0]) if place else None
    compact = document.file.value(section, "CompactSubObj")
    return described is not None and described.code == ObjectCode.RECORD and compact != ""


def _doubled_text(document: Document, title: eds_value.EdsLine) -> str:
    others = _contradicting(document, title)
    more = f" and {len(others) - 1} more" if others[1:] else ""
    what = "is there twice: of each keyword the first is taken"
    return f"{what}: {others[0]}{more}" if others else what


def _plain(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    return (document.with_value(line, eds_value.plain_numbers(line.value)),)


def _word(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Write the number that a word stands for."""
    return (document.with_value(line, _taken(finding)),)


def _taken(finding: Finding) -> str:
    """Return the value that the reader reports to use."""
    return finding.reason.rpartition(": ")[2].partition(" ")[0]


def _access(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    known = LONE_LETTERS.get(line.value.lower())
    return (document.with_value(line, known),) if known else ()


def _empty(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Set an empty keyword to its implied value. A DataType is set only if CiA 301 defines it."""
    if line.key.lower() == "datatype" and _taken(finding) == str(int(DataType.DOMAIN)):
        return ()
    return (document.with_value(line, _taken(finding)),)


def _standard_type(
    document: Document, finding: Finding, line: eds_value.EdsLine
) -> tuple[Edit, ...]:
    """Add the data type that CiA 301 gives an object, if there is one."""
    kind = DataType[_taken(finding)]
    if kind is DataType.DOMAIN:
        return ()
    return (document.add_to(finding.section, [f"DataType=0x{kind:04X}"]),)


def _bytes(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Write the bytes that are used. Only the author of the file knows the meaning of a text."""
    taken = finding.reason.rpartition(": ")[2].removesuffix(" is taken").replace(" ", "")
    is_plain = eds_value.is_hex_bytes(taken) and eds_value.without_comment(line.value) == line.value
    return (document.with_value(line, taken),) if is_plain else ()


def _bit_rate(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Write the bit rate in kbit/s if the value seems to be in bit/s."""
    taken = _taken(finding)
    return (document.with_value(line, taken),) if taken.isdecimal() else ()


def _kind(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Write the object type that is used, if the object has sub-indices."""
    place = eds_value.object_section(finding.section)
    described = document.device.objects.get(place[0]) if place is not None else None
    if described is None or not document.subs(place[0] if place else 0):
        return ()
    return (document.with_value(line, f"0x{described.code:X}"),)


def _comment(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Turn a line into a comment. Before the first section, turn all lines into comments.

    Lines of a section that lost its title are not changed. As comments, their keywords would be
    lost without a message.
    """
    lines = [line]
    if not line.section and document.head_is_lost:
        return ()
    if not line.section:
        before = takewhile(lambda other: not other.title, document.file.lines)
        lines = [
            other for other in before if other.content and not (other.is_keyword and other.key)
        ]
    return tuple(document.comment_out(other.number) for other in lines)


def _doubled_key(document: Document, finding: Finding, line: eds_value.EdsLine) -> tuple[Edit, ...]:
    """Drop a keyword that repeats the same value.

    If the two values differ, the right value is unknown, and both are kept.
    """
    first = document.keyword(line.section, line.key)
    same = first is not None and first.value == line.value
    return (Edit(line.number),) if same else ()


def _doubled_section(
    document: Document, finding: Finding, line: eds_value.EdsLine
) -> tuple[Edit, ...]:
    """Move keywords to the first section and remove the title, unless they contradict it."""
    if _contradicting(document, line):
        return ()
    moved: list[str] = []
    edits = [Edit(line.number)]
    for other, first in _again(document, line):
        edits.append(Edit(other.number))
        if first is None or first.number == other.number:
            moved.append(document.texts[other.number - 1])
    if moved:
        edits.append(document.add_to(line.section, moved))
    return tuple(edits)


def _again(
    document: Document, title: eds_value.EdsLine
) -> Iterator[tuple[eds_value.EdsLine, eds_value.EdsLine | None]]:
    """Yield the keywords after a title, each with the line whose value counts."""
    lines = document.file.lines  # a slice would copy the whole rest, for each title
    behind = (lines[at] for at in range(title.number, len(lines)))
    for line in takewhile(lambda other: not other.title, behind):
        if line.is_keyword and line.key:
            yield line, document.keyword(title.section, line.key)


def _contradicting(document: Document, title: eds_value.EdsLine) -> list[str]:
    """Return the contradictions of a repeated section."""
    return [
        f"{shorten(line.content)} against {shorten(first.value)}"
        for line, first in _again(document, title)
        if first is not None and first.value != line.value
    ]


_MENDS: Final[dict[str, Callable[[Document, Finding, eds_value.EdsLine], tuple[Edit, ...]]]] = {
    "number-form": _plain,
    "number-word": _word,
    "access-form": _access,
    "empty-value": _empty,
    "data-type-missing": _standard_type,
    "value-sign": _word,
    "byte-form": _bytes,
    "bit-rate-unit": _bit_rate,
    "object-type": _kind,
    "no-keyword": _comment,
    "doubled-key": _doubled_key,
    "doubled-section": _doubled_section,
    "compact-record": lambda document, finding, _: compact_edits(document, finding.section),
}

_OF_LINES: Final = ("inline-comment", "sub0-missing")
"""Rules of the reader whose violations a rule for lines or objects also reports."""
_OF_ONE_ENTRY: Final = ("data-type-missing", "access-missing")


def stray_lines(document: Document) -> Iterator[RuleFinding]:
    """Find lines without a meaning, and duplicates, in places that the reader skips."""
    seen: set[tuple[str, str]] = set()
    for line in document.file.lines:
        if line.title:
            again = (line.section, "") in seen and not eds_value.describes_device(line.section)
            seen.add((line.section, ""))
            if again:
                finding = Finding(document.name, line.section, "", line.number)
                edits = _doubled_section(document, finding, line)
                what = _doubled_text(document, line)
                yield document.found("doubled-section", what, line.section, line.number, *edits)
        elif line.content and not eds_value.describes_device(line.section):
            yield from _stray(document, line, seen)
        elif line.content and not line.section and line.is_keyword and line.key:
            what = f"{shorten(line.content)!r} is before the first section"
            edits = () if document.head_is_lost else (document.comment_out(line.number),)
            yield document.found("no-keyword", what, "", line.number, *edits)


def _stray(
    document: Document, line: eds_value.EdsLine, seen: set[tuple[str, str]]
) -> Iterator[RuleFinding]:
    if not line.is_keyword or not line.key:
        what = f"{shorten(line.content)!r} is no keyword with a value"
        edit = document.comment_out(line.number)
        yield document.found("no-keyword", what, line.section, line.number, edit)
    elif (line.section, line.key.lower()) in seen:
        finding = Finding(document.name, line.section, "", line.number)
        edits = _doubled_key(document, finding, line)
        yield document.found(
            "doubled-key", f"{shorten(line.key)} is there twice", line.section, line.number, *edits
        )
    else:
        seen.add((line.section, line.key.lower()))
