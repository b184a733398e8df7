"""Fixes of an EDS that do not require knowledge about the device."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from tickrig.host.canopen.data_sheet.check import check, failing
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, EditPlace, RuleFinding
from tickrig.wire.canopen.eds.eds_file import UTF_8_MARK, shorten

_MOST_PASSES: Final = 50
_WRITTEN_AS: Final = {
    **{"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"},
    **{"°": "deg", "µ": "u", "μ": "u", "Ω": "Ohm", "\N{OHM SIGN}": "Ohm", "±": "+-", "€": "EUR"},
    **{"©": "(c)", "®": "(R)", "•": "*", "·": "*", "„": '"', "“": '"', "”": '"'},
    **dict.fromkeys("\u2013\u2014", "-"),
    **dict.fromkeys("\u2018\u2019", "'"),
}
"""ASCII replacements for letters that do not become ASCII by removing accents."""
_CUT: Final = "truncated"
_NO_LETTER: Final = re.compile("[\udc80-\udcff]")
"""Bytes that have no letter in their encoding."""


@dataclass(frozen=True, slots=True)
class _Fixed:
    """A fixed file.

    Attributes:
        document: the fixed document.
        mended: fixed findings, with their lines in the original file.
        left: remaining errors and warnings, with their lines in the fixed file.
        origins: line number in the original file, for each line.
    """

    document: Document
    mended: tuple[RuleFinding, ...]
    left: tuple[RuleFinding, ...]
    origins: tuple[int, ...]

    def before(self, one: RuleFinding) -> RuleFinding:
        """Return a remaining finding with its line in the original file."""
        return replace(one, line=_origin(self.origins, one.line))


def fix(document: Document, *, ascii_only: bool = False) -> _Fixed:
    """Correct errors and warnings of an EDS, if this is possible without knowledge of the device.

    Lines without findings keep all their bytes. A file that looks truncated is not changed, because
    it would look complete after a fix. A file in another encoding than Unicode is converted to
    UTF-8.

    Args:
        document: EDS to correct.
        ascii_only: whether to replace letters outside ASCII by ASCII letters.
    """
    mended: list[RuleFinding] = []
    origins = list(range(1, len(document.texts) + 1))
    left = failing(check(document), strict=True)
    if any(one.rule.name == _CUT for one in left):
        return _Fixed(document, (), tuple(left), tuple(origins))
    for _ in range(_MOST_PASSES):
        plan = _Plan()
        wanted = [*left, *_beyond_ascii(document)] if ascii_only else left
        taken = [one for one in wanted if document.changes(one.edits) and plan.take(one.edits)]
        if not taken:
            break
        mended += (replace(one, line=_origin(origins, one.line)) for one in taken)
        document, origins = plan.carry_out(document, origins)
        left = failing(check(document), strict=True)
    return _Fixed(document, tuple(dict.fromkeys(mended)), tuple(left), tuple(origins))


def _beyond_ascii(document: Document) -> Iterator[RuleFinding]:
    """Find lines with non-ASCII letters, and the edits that replace these letters."""
    for number, text in enumerate(document.texts, 1):
        if text.isascii():
            continue
        letters = dict.fromkeys(letter for letter in text if not letter.isascii())
        said = ", ".join(f"{shorten(letter)!r} as {_in_ascii(letter)!r}" for letter in letters)
        edit = Edit(number, lines=("".join(map(_in_ascii, text)),))
        yield document.found(
            "non-ascii", f"letters beyond ASCII are written: {said}", "", number, edit
        )


def _in_ascii(letter: str) -> str:
    """Return an ASCII letter for a letter, or `?` if there is no similar letter.

    >>> [_in_ascii(letter) for letter in "öéß°Ω²✓"]
    ['oe', 'e', 'ss', 'deg', 'Ohm', '2', '?']
    """
    if letter.isascii():
        return letter
    if letter in _WRITTEN_AS:
        return _WRITTEN_AS[letter]
    plain = unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
    return plain if plain.isprintable() and plain else "?"


def _origin(origins: Sequence[int], line: int) -> int:
    return origins[line - 1] if 0 < line <= len(origins) else line


class _Plan:
    """Edits that do not conflict with each other."""

    def __init__(self) -> None:
        self._lines: dict[int, tuple[str, ...]] = {}
        self._added: dict[int, dict[tuple[str, ...], None]] = {}
        self._places: set[EditPlace] = set()

    def take(self, edits: tuple[Edit, ...]) -> bool:
        """Add edits. If they conflict with planned edits, add none and return False."""
        for line, place, lines in edits:
            if place is EditPlace.REPLACE and self._lines.get(line, lines) != lines:
                return False
        for line, place, lines in edits:
            if place is EditPlace.REPLACE:
                self._lines[line] = lines
            elif place is EditPlace.AFTER:
                self._added.setdefault(line, {})[lines] = None
            else:
                self._places.add(place)
        return True

    def carry_out(self, document: Document, origins: list[int]) -> tuple[Document, list[int]]:
        """Return the document after the edits, and the original line of each line."""
        usual = _usual_end(document.ends)
        lines: list[tuple[str, str, int]] = []
        self._add(lines, 0, usual, 1)
        for number, (text, end) in enumerate(zip(document.texts, document.ends, strict=True), 1):
            origin = origins[number - 1]
            if end == "\r" and EditPlace.LINE_ENDS in self._places:
                end = usual  # noqa: PLW2901 - the new encoding of the document
            kept = self._lines.get(number, (text,))
            last = number == len(document.texts)
            if last and number in self._added and kept == ("",):
                kept = ()
            lines += ((each, end or usual, origin) for each in kept[:-1])
            if kept:
                lines.append((kept[-1], usual if number in self._added else end, origin))
            self._add(lines, number, usual, origin)
        text = "".join(text + end for text, end, _ in lines)
        data = self._encoded(document, text)
        changed = Document(document.name, data)
        return changed, _padded([origin for *_, origin in lines], len(changed.texts))

    def _add(self, lines: list[tuple[str, str, int]], number: int, end: str, origin: int) -> None:
        for texts in self._added.get(number, {}):
            lines += ((text, end, origin) for text in texts)

    def _encoded(self, document: Document, text: str) -> bytes:
        if not document.is_unicode and EditPlace.ENCODING in self._places:
            plain = _NO_LETTER.sub("\ufffd", text)
            return plain.encode("utf-8")
        if document.encoding.startswith("utf-16"):
            return text.encode("utf-8", "replace")
        keeps = document.has_bom and EditPlace.ENCODING not in self._places
        coded = text.encode(document.encoding, "surrogateescape")
        return (UTF_8_MARK if keeps else b"") + coded


def _usual_end(ends: list[str]) -> str:
    """Return the most frequent line end. CR alone does not count."""
    return "\r\n" if ends.count("\r\n") > ends.count("\n") else "\n"


def _padded(origins: list[int], length: int) -> list[int]:
    """Return one origin for each line."""
    last = origins[-1] if origins else 1
    return (origins + [last] * (length - len(origins)))[:length]
