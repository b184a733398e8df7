"""An EDS as the bytes of its lines, and as the device that the reader makes from them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Final

from tickrig.host.canopen.data_sheet.rule import RULES, Edit, EditPlace, RuleFinding
from tickrig.wire.canopen.eds import eds_file
from tickrig.wire.canopen.eds.eds_device import read_device
from tickrig.wire.canopen.eds.eds_value import EdsLine
from tickrig.wire.canopen.eds.object_table import EntryDescription

_BOM: Final = "\ufeff"
_END: Final = re.compile(r"(\r\n|\r|\n)")


class Document:
    """An EDS file as lines and as a device.

    Args:
        name: name of the file in findings.
        data: bytes of the whole file.
        encoding: Python name of the file's encoding, or empty to detect the encoding from the
            bytes.

    Attributes:
        name: name of the file in findings.
        data: bytes of the whole file.
        encoding: Python name of the file's encoding.
        has_bom: whether the file begins with a byte order mark.
        texts: lines of the file, without line ends.
        ends: end of each line, empty for the last line.
        file: sections of the file.
        device: device that the sections describe.
        rows: entries of the device by index and sub-index.
        findings: result of `check`, or None before the first call.
    """

    def __init__(self, name: str, data: bytes, encoding: str = "") -> None:
        coded = data.removeprefix(eds_file.UTF_8_MARK)
        self.name, self.data = name, data
        self.encoding = encoding or eds_file.encoding_of(coded)
        text = coded.decode(self.encoding, self._lossless)
        self.has_bom = coded != data or text.startswith(_BOM)
        parts = _END.split(text.removeprefix(_BOM))
        self.texts, self.ends = parts[::2], [*parts[1::2], ""]
        self.file = eds_file.EdsFile(name, eds_file.decode_text(data, self.encoding))
        self.device = read_device(self.file)
        self.rows = {(row.index, row.sub): row for row in self.device.entries}
        self._entries: dict[int, list[EntryDescription]] = {}
        for _, row in sorted(self.rows.items()):
            self._entries.setdefault(row.index, []).append(row)
        self.findings: list[RuleFinding] | None = None
        self._keywords: dict[tuple[str, str], EdsLine] = {}
        for line in self.file.lines:
            if line.is_keyword:
                self._keywords.setdefault((line.section, line.key.lower()), line)
        self._blocks = self._read_blocks()
        self._first = {line.number for block in self._blocks.values() for line in block}
        self._subs: dict[int, list[int]] = {}
        for _, index, sub in self.file.objects():
            if sub is not None:
                self._subs.setdefault(index, []).append(sub)

    @property
    def _lossless(self) -> str:
        return "replace" if self.encoding.startswith("utf-16") else "surrogateescape"

    @property
    def is_unicode(self) -> bool:
        """Whether the encoding is UTF-8, which includes ASCII, or UTF-16."""
        return eds_file.encoding_of(self.data) not in eds_file.CODE_PAGES

    def letters(self, line: int) -> str:
        """Describe the first non-ASCII byte of a line. The description is part of a finding.

        An EDS does not name its encoding. So the description lists the possible encodings, and the
        letter that the byte stands for in each of them.
        """
        byte = next(letter for letter in self.texts[line - 1] if not letter.isascii())
        coded = byte.encode(self.encoding, "surrogateescape")
        pages = dict.fromkeys((self.encoding, *eds_file.CODE_PAGES))
        said = (f"{coded.decode(page, 'replace')!r} in {page}" for page in pages)
        return f"byte {coded.hex().upper()}h is {', '.join(said)}"

    def keyword(self, section: str, key: str) -> EdsLine | None:
        """Return the line that sets a keyword, or None if no line sets it."""
        return self._keywords.get((section, key.lower()))

    def subs(self, index: int) -> list[int]:
        """Return the sub-indices that have sections of their own."""
        return self._subs.get(index, [])

    def entries(self, index: int) -> list[EntryDescription]:
        """Return the entries of an object by sub-index.

        The list is empty if the file lacks the object.
        """
        return self._entries.get(index, [])

    def section_of(self, row: EntryDescription) -> str:
        """Return the section of an entry, or the section of its object if the entry has none."""
        section = f"{row.index:04X}sub{row.sub:X}"
        return section if section in self.file.sections else f"{row.index:04X}"

    def found(
        self, rule: str, text: str, section: str = "", line: int | str = "", *edits: Edit
    ) -> RuleFinding:
        """Create the finding that a part of this file violates a rule.

        Args:
            rule: name of the violated rule.
            text: invalid value, and the allowed values.
            section: title of the section, empty for the file as a whole.
            line: number of the line, or the keyword in the line. By default, the finding is about
                the first line of the section.
            edits: edits of the file that correct the violation.
        """
        number = line if isinstance(line, int) else self.file.line(section, line)
        kept = () if self.file.is_xml else edits
        return RuleFinding(RULES[rule], self.name, number, eds_file.shorten(section), text, kept)

    def changes(self, edits: Sequence[Edit]) -> bool:
        """Return whether edits would change the file, using only letters that its encoding has."""
        added = "".join(text for edit in edits for text in edit.lines)
        return self._can_hold(added) and any(
            place is not EditPlace.REPLACE or lines != (self.texts[line - 1],)
            for line, place, lines in edits
        )

    def _can_hold(self, text: str) -> bool:
        """Return whether a text can be encoded. A byte that is not a letter cannot be encoded."""
        if self.encoding.startswith("utf-16"):
            return True
        try:
            text.encode(self.encoding, "surrogateescape")
        except UnicodeEncodeError:
            return False
        return True

    def with_value(self, line: EdsLine, value: str) -> Edit:
        """Return the edit that gives a keyword another value. Blanks and comment are kept."""
        text = self.texts[line.number - 1]
        begin = text.find("=") + 1
        at = text.index(line.value, begin) if line.value in text[begin:] else begin
        return Edit(line.number, lines=(text[:at] + value + text[at + len(line.value) :],))

    def comment_out(self, number: int) -> Edit:
        """Return the edit that makes a line a comment."""
        return Edit(number, lines=(f";{self.texts[number - 1]}",))

    def add_to(self, section: str, texts: Iterable[str]) -> Edit:
        """Return the edit that appends lines to a section."""
        numbers = [line.number for line in self._blocks.get(section, ()) if line.content]
        return Edit(max(numbers, default=0), EditPlace.AFTER, tuple(texts))

    def is_again(self, line: EdsLine) -> bool:
        """Return whether a line is in a section whose title has occurred before."""
        return line.number not in self._first

    @cached_property
    def head_is_lost(self) -> bool:
        """Whether the lines before the first title seem to have lost their title."""
        return any("[" in line.content for line in self._blocks[""] if not line.title)

    def lines_of(self, section: str) -> list[EdsLine]:
        """Return the `KEY=VALUE` lines of a section.

        If several sections have the same title, these are the lines of the first one.
        """
        return [line for line in self._blocks.get(section, ()) if line.is_keyword]

    def _read_blocks(self) -> dict[str, list[EdsLine]]:
        """Return the lines of each section, up to the end of its first occurrence."""
        blocks: dict[str, list[EdsLine]] = {}
        block: list[EdsLine] = blocks.setdefault("", [])
        for line in self.file.lines:
            if line.title:
                known = line.section in blocks
                block = [] if known else blocks.setdefault(line.section, [])
            block.append(line)
        return blocks
