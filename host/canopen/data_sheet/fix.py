"""What a file is when all is mended that needs no knowledge of the device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from tickrig.host.canopen.data_sheet.check import check, failing
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, Place, RuleFinding
from tickrig.wire.canopen.eds.eds_file import UTF_8_MARK

MOST_PASSES: Final = 50
CUT: Final = "truncated"


@dataclass(frozen=True, slots=True)
class Fixed:
    """A file that was mended.

    Attributes:
        document: as it is now.
        mended: what was found and is gone, with the lines of the file as it was.
        left: errors and warnings that are still there, with the lines of the file as it is.
        origins: the lines of the file before, of each line.
    """

    document: Document
    mended: tuple[RuleFinding, ...]
    left: tuple[RuleFinding, ...]
    origins: tuple[int, ...]

    def before(self, one: RuleFinding) -> RuleFinding:
        """Return what is left, with the line of the file before."""
        return replace(one, line=_origin(self.origins, one.line))


def fix(document: Document) -> Fixed:
    """Mend a file until nothing changes; lines that no finding names stay to the byte.

    A file that looks truncated stays as it is: mended, it would look whole.
    """
    mended: list[RuleFinding] = []
    origins = list(range(1, len(document.texts) + 1))
    left = failing(check(document), strict=True)
    if any(one.rule.name == CUT for one in left):
        return Fixed(document, (), tuple(left), tuple(origins))
    for _ in range(MOST_PASSES):
        plan = _Plan()
        taken = [one for one in left if document.changes(one.edits) and plan.take(one.edits)]
        if not taken:
            break
        mended += (replace(one, line=_origin(origins, one.line)) for one in taken)
        document, origins = plan.carry_out(document, origins)
        left = failing(check(document), strict=True)
    return Fixed(document, tuple(dict.fromkeys(mended)), tuple(left), tuple(origins))


def _origin(origins: Sequence[int], line: int) -> int:
    return origins[line - 1] if 0 < line <= len(origins) else line


class _Plan:
    """Edits that do not contradict each other."""

    def __init__(self) -> None:
        self._lines: dict[int, tuple[str, ...]] = {}
        self._added: dict[int, dict[tuple[str, ...], None]] = {}
        self._places: set[Place] = set()

    def take(self, edits: tuple[Edit, ...]) -> bool:
        """Add edits; False, and none of them, where they contradict others."""
        for line, place, lines in edits:
            if place is Place.REPLACE and self._lines.get(line, lines) != lines:
                return False
        for line, place, lines in edits:
            if place is Place.REPLACE:
                self._lines[line] = lines
            elif place is Place.AFTER:
                self._added.setdefault(line, {})[lines] = None
            else:
                self._places.add(place)
        return True

    def carry_out(self, document: Document, origins: list[int]) -> tuple[Document, list[int]]:
        """Return the document that comes of it, and where its lines were."""
        usual = _usual_end(document.ends)
        lines: list[tuple[str, str, int]] = []
        self._add(lines, 0, usual, 1)
        for number, (text, end) in enumerate(zip(document.texts, document.ends, strict=True), 1):
            origin = origins[number - 1]
            if end == "\r" and Place.LINE_ENDS in self._places:
                end = usual  # noqa: PLW2901 - what it is from here on
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
        if document.encoding.startswith("utf-16"):
            return text.encode("utf-8", "replace")
        keeps = document.has_bom and Place.ENCODING not in self._places
        coded = text.encode(document.encoding, "surrogateescape")
        return (UTF_8_MARK if keeps else b"") + coded


def _usual_end(ends: list[str]) -> str:
    """Return how most lines end; CR alone is no end."""
    return "\r\n" if ends.count("\r\n") > ends.count("\n") else "\n"


def _padded(origins: list[int], length: int) -> list[int]:
    """Return as many origins as there are lines."""
    last = origins[-1] if origins else 1
    return (origins + [last] * (length - len(origins)))[:length]
