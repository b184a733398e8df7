"""Rules for the text: encoding, line ends, titles, keywords, comments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, EditPlace, RuleFinding
from tickrig.host.canopen.data_sheet.rules.known_keys import SECTION, is_number, keys_of, numbered
from tickrig.host.canopen.data_sheet.rules.value_rules import kind_of
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.eds.eds_value import KNOWN_SECTIONS, EdsLine, without_comment

_CONTROLS: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")
_PLAIN: Final = re.compile(
    r"\[[0-9A-Fa-f]{1,4}(sub(0|[1-9A-Fa-f][0-9A-Fa-f]?)|Name|Value|Denotation|ObjectLinks)?\]"
    r"|\[(M[0-9]|Tool).*\]"
)
_INLINE: Final = re.compile(r"(?<!\s)\s++;.*$")
_BEHIND_WORD: Final = re.compile(r"(?<!\s)\s*+(?:[#;]|//).*$")


def encoding(document: Document) -> Iterator[RuleFinding]:
    """Find encodings and characters other than plain ASCII, and a byte order mark."""
    edit = Edit(0, EditPlace.ENCODING)
    if document.encoding.startswith("utf-16"):
        yield document.found("utf-16", "the file is UTF-16, ASCII was allowed", "", 0, edit)
    elif document.has_bom and not document.file.is_xml:
        yield document.found("bom", "the file begins with a byte order mark", "", 0, edit)
    if document.file.is_xml:
        return
    if not document.is_unicode:
        first = next(at for at, text in enumerate(document.texts, 1) if not text.isascii())
        what = f"not UTF-8, which the canopen library and dcf-tools need; {document.letters(first)}"
        yield document.found("not-utf-8", what, "", first, edit)
    for number, text in enumerate(document.texts, 1):
        if not text.isascii():
            what = f"{shorten(text.strip())!r} has letters beyond ASCII"
            yield document.found("non-ascii", what, "", number)
        if _CONTROLS.search(text):
            clean = Edit(number, lines=(_CONTROLS.sub("", text),))
            what = "the line has a control character"
            yield document.found("control-character", what, "", number, clean)


def line_ends(document: Document) -> Iterator[RuleFinding]:
    """Find lines that end with CR alone, and files with mixed line ends."""
    ends = set(document.ends) - {""}
    if "\r" in ends:
        first = document.ends.index("\r") + 1
        edit = Edit(0, EditPlace.LINE_ENDS)
        yield document.found("line-ends", "the line ends with CR alone", "", first, edit)
    elif len(ends) > 1:
        other = document.ends.index("\n" if document.ends[0] == "\r\n" else "\r\n") + 1
        yield document.found("mixed-line-ends", "the file mixes CR LF and LF", "", other)


def titles(document: Document) -> Iterator[RuleFinding]:
    """Find section titles that CiA 306 spells differently, and unknown sections."""
    for line in document.file.lines:
        if not line.title:
            continue
        if line.section in KNOWN_SECTIONS.values() or SECTION.fullmatch(line.section):
            yield from _title(document, line)
        else:
            what = f"[{shorten(line.section)}] is not a section of CiA 306"
            yield document.found("unknown-section", what, "", line.number)


def _title(document: Document, line: EdsLine) -> Iterator[RuleFinding]:
    """Check the title of a known section. Hexadecimal digits may be upper or lower case."""
    wanted = f"[{line.section}]"
    named = line.section in KNOWN_SECTIONS.values()
    plain = not named and _PLAIN.fullmatch(line.content)
    if line.content != wanted and not plain:
        edit = Edit(line.number, lines=(wanted,))
        what = f"{shorten(line.content)} stands for {wanted}"
        yield document.found("section-form", what, "", line.number, edit)


def keywords(document: Document) -> Iterator[RuleFinding]:
    """Find unknown keywords, and keywords that CiA 306 spells differently."""
    for line in document.file.lines:
        known = keys_of(line.section)
        if not line.is_keyword or not line.key or known is None:
            continue
        spelled = known.get(line.key.lower()) or numbered(line.section, line.key)
        if spelled is None:
            what = f"{shorten(line.key)} is not a keyword of CiA 306 here"
            yield document.found("unknown-key", what, line.section, line.number)
        elif spelled != line.key:
            text = document.texts[line.number - 1].replace(line.key, spelled, 1)
            what = f"{shorten(line.key)} stands for {spelled}"
            edit = Edit(line.number, lines=(text,))
            yield document.found("key-case", what, line.section, line.number, edit)


def comments(document: Document) -> Iterator[RuleFinding]:
    """Find comments that some readers do not recognise as comments."""
    for line in document.file.lines:
        text = line.text.strip()
        raw = document.texts[line.number - 1]
        if text.startswith("#"):
            what = f"{shorten(text)!r} begins with #"
            yield document.found("hash-comment", what, line.section, line.number)
            continue
        match = _INLINE.search(raw) if line.content and text != line.content else None
        behind = without_comment(line.value) != line.value
        if match is None and behind and line.is_keyword and _is_word(document, line):
            match = _BEHIND_WORD.search(raw, raw.index("=") + 1)
        if match is not None:
            remark = match[0].strip().lstrip("#/;").strip()
            kept = [f"; {remark}"] if remark else []
            alone = Edit(line.number, lines=(*kept, raw[: match.start()]))
            what = f"a comment follows {shorten(raw[: match.start()].strip())!r}"
            yield document.found("inline-comment", what, line.section, line.number, alone)


def _is_word(document: Document, line: EdsLine) -> bool:
    """Return whether a line holds a number or an access type. Other texts may contain `#`."""
    if line.key.lower() == "accesstype" or is_number(line.section, line.key):
        return line.key.lower() != "count"
    return kind_of(document, line) is not None
