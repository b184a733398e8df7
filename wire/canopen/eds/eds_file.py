"""Electronic data sheets as sections of keywords (CiA 306, CiA 311)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.wire.canopen.eds import eds_value
from tickrig.wire.canopen.eds.xdd import XddError, is_xml, xdd_lines

# Theory of operation
# ===================
#
# EDS files are written by hand and by tools, and hardly one keeps to CiA 306 throughout.
# The rule for all readers here: what has one meaning is read, with a warning that says what
# is taken; what has none, or would make it another device than its author meant, is an
# error. Readers do not raise: `EdsFile` collects all findings, each once, with line and
# rule name, and a user sees them all at once.
#
# The readers stand on each other, and each knows only the one below:
#
# eds_value.py    lines, section names, numbers and values as text
# xdd.py          XML as the lines that an EDS would have, so that all above read both
# eds_file.py     sections and keywords; findings with their places
# eds_entry.py    one object: type, access, default, limits
# eds_device.py   the whole: kinds of objects, CompactPDO, modules, commissioning
#
# Order matters in a few places. The first of two equal keywords counts, as most readers
# have it. Keywords are compared in lower case, sections in the spelling of CiA 306
# (`canonical_section`). Of values `ParameterValue` goes before `[INDEXValue]`, and that
# before `DefaultValue`. A `;` behind a blank begins a comment everywhere; `#` and `//` do
# so behind numbers and words, but in a text they may be meant and stay.
#
# Rule names (`no-number`, `access-form`, ...) are public: `canmon eds check` prints them and
# its JSON and JUnit reports have them, so that others filter by them. A message says what
# came and what is taken.
#
# The same files are read for each node of a network, so the plain case is quick:
# `is_plain_number` and the caches of section names are what the time of a file goes into.

_LONGEST: Final = 40
_LONGEST_TITLE: Final = len("1018sub01")
"""Length of the longest title of a section of an object, such as `1018sub01`."""
_DCF_ENDINGS: Final = (".dcf", ".xdc")


class Finding(NamedTuple):
    """An error or warning about an EDS file, with its position in the file.

    Attributes:
        file: name of the file.
        section: name of the section without brackets, or empty for the file as a whole.
        reason: description of the error. It contains the key or line of the file, and the value
            that is allowed or that is used instead.
        line: line number, or 0 for the file as a whole.
        rule: name of the violated rule of `canmon eds check`, or empty if there is none.
    """

    file: str
    section: str
    reason: str
    line: int = 0
    rule: str = ""

    def __str__(self) -> str:
        """Return the finding as one line."""
        place = f"{self.file}:{self.line}" if self.line else self.file
        where = f"[{shorten(self.section)}] " if self.section else ""
        return f"{place}: {where}{self.reason}" + (f" ({self.rule})" if self.rule else "")


def finding_lines(findings: Iterable[Finding]) -> Iterator[str]:
    """Yield errors and warnings about EDS files as lines of text.

    If several sections of a file have the same error or warning, only the first of them has a line.
    The line ends with the number of the other sections.
    """
    alike: dict[tuple[str, str], list[Finding]] = {}
    for finding in dict.fromkeys(findings):
        alike.setdefault((finding.file, finding.reason), []).append(finding)
    for first, *others in alike.values():
        more = f" (and {len(others)} more like it)" if others else ""
        yield f"{first}{more}"


class EdsError(ValueError):
    """The EDS cannot be used; the message has all findings, one per line."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(map(str, self.findings)))


def shorten(text: str) -> str:
    r"""Return a text of a file shortened to one printable line.

    >>> shorten("a" * 99) == "a" * 37 + "...", shorten("a\x00b")
    (True, 'a?b')
    """
    if not text.isprintable():
        text = "".join(letter if letter.isprintable() else "?" for letter in text)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


_Section = dict[str, str]
_NO_WORDS: Final[Mapping[str, int]] = {}

_OWN_WORD: Final = re.compile(r"(MaxBytes|DefaultBytes) of (\w+) is (\w+)")


@mypyc_attr(serializable=True)
class EdsFile:
    """The sections of an EDS, DCF, XDD or XDC, as CiA 306 spells them.

    The object collects findings: first findings of the lines, then findings of the readers. An
    unreadable line matters only in a section that describes the device. If a section or keyword is
    duplicate, the first one is used, as in most readers.

    Args:
        name: name of the file in findings.
        text: content of the file.

    Attributes:
        sections: texts by section and lower-case keyword. Sections have names such as `1017`,
            `1018sub1`, `DeviceInfo`.
        lines: all lines. For XML these are the equivalent EDS lines, with the line numbers of their
            elements.
        is_xml: whether the file is XML.
        errors: findings that change the described device.
        warnings: deviations from the standard with a clear meaning.
    """

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.sections: dict[str, _Section] = {}
        self.is_xml = is_xml(text)
        self.lines: list[eds_value.EdsLine] = []
        self._places: dict[tuple[str, str], int] = {}
        self._objects: list[tuple[str, int, int | None]] = []  # each rule goes through them
        self._errors: dict[Finding, None] = {}
        self._warnings: dict[Finding, None] = {}
        self._has_long_titles = False
        try:
            self.lines = xdd_lines(text) if self.is_xml else eds_value.read_lines(text)
        except XddError as error:
            self._errors[Finding(name, "", str(error), error.line, "xml")] = None
        self._parse()

    @property
    def errors(self) -> tuple[Finding, ...]:
        """All errors, without duplicates, in the order of their detection."""
        return tuple(self._errors)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """All warnings, without duplicates, in the order of their detection."""
        return tuple(self._warnings)

    @property
    def is_dcf(self) -> bool:
        """Whether the file is a DCF: it has the suffix of a DCF, or it contains a node-ID."""
        return self.name.lower().endswith(_DCF_ENDINGS) or "DeviceComissioning" in self.sections

    def refuse(self, section: str, reason: str, rule: str, key: str = "") -> None:
        """Add an error at the line of a keyword or a section."""
        line = self.line(section, key)
        self._errors[Finding(self.name, section, reason, line, rule)] = None

    def warn(self, section: str, reason: str, rule: str, key: str = "") -> None:
        """Add a warning at the line of a keyword or a section."""
        line = self.line(section, key)
        self._warnings[Finding(self.name, section, reason, line, rule)] = None

    def line(self, section: str, key: str = "") -> int:
        """Return the line number of a keyword in a section.

        If the section does not have the keyword, the result is the line of the section. If the file
        does not have the section, the result is 0.
        """
        place = self._places.get((section, key.lower()))
        return place or self._places.get((section, ""), 0)

    def value(self, section: str, key: str) -> str:
        """Return the text of a keyword, or "" if it is missing; see `word`."""
        found = self.sections.get(section)
        return "" if found is None else found.get(key.lower(), "")

    def has(self, section: str, key: str) -> bool:
        """Return whether a keyword exists, with or without a text."""
        return key.lower() in self.sections.get(section, {})

    def word(self, section: str, key: str) -> str:
        """Return the value of a keyword that is a number or a word, without a trailing comment.

        A trailing comment begins with `;`, `#` or `//`. These characters have no other meaning
        after a number or an access type. In CiA 306 a comment is a line of its own, but many
        programs also accept a comment that begins with ` ;` after a value. Each trailing comment
        adds a warning to the findings.
        """
        text = self.value(section, key)
        said = eds_value.without_comment(text)
        if said != text:
            what = "the comment behind a number or an access type is skipped"
            self.warn(section, what, "inline-comment", key)
        return said

    def numeric(self, section: str, key: str) -> str:
        """Return the text of a number from the file, converted to the notation of CiA 306.

        If the number in the file has another notation, a warning is added to the findings.
        """
        text = self.value(section, key)
        if eds_value.is_plain_number(text):
            return text
        text = self.word(section, key)
        plain = eds_value.plain_numbers(text)
        if plain != text:
            what = f"{key}={shorten(text)} is no number of CiA 306: {shorten(plain)} is taken"
            self.warn(section, what, "number-form", key)
        return plain

    def number(  # noqa: PLR0913, PLR0917 - a place, and what counts there
        self,
        section: str,
        key: str,
        default: int = 0,
        low: int = 0,
        high: int = 0xFFFF_FFFF,
        words: Mapping[str, int] = _NO_WORDS,
    ) -> int:
        """Return the value of a keyword as a number.

        If the keyword is missing, the result is the default. If the value is empty, is not a
        number, or is not within `low` to `high`, the result is also the default, and a warning is
        added.

        Args:
            section: section of the keyword.
            key: the keyword.
            default: number that is used instead of a missing or invalid value.
            low: smallest allowed number.
            high: largest allowed number.
            words: words in lower case that are accepted in place of a number, with a warning.
        """
        text = self.numeric(section, key)
        if not text:
            if self.has(section, key):
                self.warn(section, f"{key} is empty: {default} is taken", "empty-value", key)
            return default
        said = f"{key}={shorten(text)}"
        if (word := words.get(text.lower())) is not None:
            self.warn(section, f"{said} is not a number: {word} is taken", "number-word", key)
            return word
        try:
            number = eds_value.parse_number(text)
        except ValueError:
            reason = f"{said} is not a number: {default} is taken"
            self.warn(section, reason, "no-number", key)
            return default
        if low <= number <= high:
            return number
        reason = f"{said} is not in {low}..{high}: {default} is taken"
        self.warn(section, reason, "no-number", key)
        return default

    def objects(self) -> Iterator[tuple[str, int, int | None]]:
        """Return the sections of objects, with index and sub-index (None for the object itself)."""
        return iter(self._objects)

    def _parse(self) -> None:
        section: _Section = {}
        for line in self.lines:
            if line.title:
                section = self._begin(line)
            elif line.is_keyword:
                self._add(section, line)
            elif line.content and eds_value.describes_device(line.section):
                self._skip(line)
        self._take_comments()
        places = ((section, eds_value.object_section(section)) for section in self.sections)
        self._objects = [(section, *place) for section, place in places if place]

    def _take_comments(self) -> None:
        """Read properties without a CiA 306 keyword from comments of `write_eds`."""
        for text in self.sections.get("Comments", {}).values():
            if match := _OWN_WORD.fullmatch(text):
                key, section, value = match.groups()
                self.sections.get(section, {}).setdefault(key.lower(), value)

    def _begin(self, line: eds_value.EdsLine) -> _Section:
        """Start a section, or continue an existing one."""
        title = line.section
        if (
            self.is_xml
            and title not in eds_value.KNOWN_SECTIONS.values()
            and eds_value.object_section(title) is None
        ):
            reason = "is no index of four, or sub-index of two hexadecimal digits: it is lost"
            self._errors[Finding(self.name, title, reason, line.number, "object-index")] = None
        is_long = self.is_xml and len(line.title) > _LONGEST_TITLE
        if is_long and not self._has_long_titles and eds_value.object_section(title) is not None:
            self._has_long_titles = True  # some editors write all of them so
            reason = "subIndex has more than two digits, taken for one number; others may follow"
            self._warn_at(line, reason, "section-form")
        if title in self.sections and eds_value.describes_device(title):
            reason = "is there twice: of each keyword the first is taken"
            self._warn_at(line, reason, "doubled-section")
        self._places.setdefault((title, ""), line.number)
        return self.sections.setdefault(title, {})

    def _add(self, section: _Section, line: eds_value.EdsLine) -> None:
        key = line.key.lower()
        # `[OptionalObjects] 01=0x1005`: some tools fill the numbers of a list up with
        # zeros.
        if key[:1] == "0" and key.isascii() and key.isdigit():
            key = key.lstrip("0") or "0"  # a number of a list
        if not key:
            if eds_value.describes_device(line.section):
                self._skip(line)
        elif key not in section:
            section[key] = line.value
            self._places[line.section, key] = line.number
        elif line.section and eds_value.describes_device(line.section):
            reason = f"{shorten(line.key)} is there twice: {shorten(section[key])} is taken"
            self._warn_at(line, reason, "doubled-key")

    def _skip(self, line: eds_value.EdsLine) -> None:
        """Report the first unreadable line before the sections, and each one in a section."""
        if line.section or not self._warnings:
            reason = f"{shorten(line.content)!r} is no keyword with a value: it is skipped"
            self._warn_at(line, reason, "no-keyword")

    def _warn_at(self, line: eds_value.EdsLine, reason: str, rule: str) -> None:
        self._warnings[Finding(self.name, line.section, reason, line.number, rule)] = None


UTF_8_MARK: Final = b"\xef\xbb\xbf"
"""Byte order mark of UTF-8; some editors write it before text of another encoding, too."""
_UTF_16: Final = (b"\xff\xfe", b"\xfe\xff")


CODE_PAGES: Final = ("cp1252", "cp850")
"""Single-byte encodings of older editors: Windows and DOS."""
_WITHIN_WORD: Final = re.compile(
    rb"(?<=[A-Za-z\x80-\xff])[\x80-\x91\x93-\xff](?=[A-Za-z\x80-\xff])"
)
_LETTERS_1252: Final = frozenset(range(0xC0, 0x100)) - {0xE1}
"""Bytes that are letters in Windows-1252, except E1h, a letter in both encodings (á, ß)."""
_LETTERS_850: Final = frozenset((*range(0x80, 0x9B), *range(0xA0, 0xA6)))
"""Bytes that are letters in CP850, and no letters in Windows-1252."""


def encoding_of(data: bytes) -> str:
    r"""Detect the encoding of a text file, and return its name in Python.

    The encoding is UTF-16 if the file has the byte order mark or if every other byte at the start
    is zero. It is UTF-8 if the file is valid UTF-8. Otherwise it is one of the single-byte
    encodings CP850 and Windows-1252. To choose one, the function compares the numbers of two groups
    of bytes inside words. Bytes from 80h to 9Ah and from A0h to A5h are letters in CP850. Bytes
    from C0h to FFh, except E1h, are letters in Windows-1252. If the first group is larger, the
    encoding is CP850, or else Windows-1252.

    Args:
        data: content of the file.

    >>> encoding_of(b"[\0F\0"), encoding_of("µ".encode()), encoding_of(b"\xb5")
    ('utf-16-le', 'utf-8', 'cp1252')
    >>> encoding_of("Schönaich".encode("cp850")), encoding_of("Schönaich".encode("cp1252"))
    ('cp850', 'cp1252')
    """
    if data[:2] in _UTF_16:
        return "utf-16-le" if data[:1] == b"\xff" else "utf-16-be"
    if data[1:4:2] == b"\0\0":
        return "utf-16-le"
    if data[:3:2] == b"\0\0":
        return "utf-16-be"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        within = [match[0][0] for match in _WITHIN_WORD.finditer(data)]
        of_dos = sum(byte in _LETTERS_850 for byte in within)
        return "cp850" if of_dos > sum(byte in _LETTERS_1252 for byte in within) else "cp1252"
    return "utf-8"


def decode_text(data: bytes, encoding: str = "") -> str:
    r"""Decode the content of a text file, and remove a byte order mark.

    Args:
        data: content of the file.
        encoding: name of the encoding in Python, or empty to detect the encoding.

    >>> decode_text("\ufeffµ".encode()), decode_text("µ".encode("cp1252"))
    ('µ', 'µ')
    >>> decode_text(b"\xef\xbb\xbf[FileInfo]\xb5")
    '[FileInfo]µ'
    """
    coded = data.removeprefix(UTF_8_MARK)
    return coded.decode(encoding or encoding_of(coded), "replace").removeprefix("\ufeff")
