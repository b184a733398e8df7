"""An electronic data sheet as sections of keywords (CiA 306)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.wire.canopen.eds.eds_value import parse_number, plain_numbers

LONGEST: Final = 40


class Finding(NamedTuple):
    """A fault of a file.

    Attributes:
        file: what the file is called.
        section: without brackets, empty for the file as a whole.
        reason: which key or line, what it says, and what was allowed or is taken instead.
    """

    file: str
    section: str
    reason: str

    def __str__(self) -> str:
        """Say it in one line."""
        where = f"[{self.section}] " if self.section else ""
        return f"{self.file}: {where}{self.reason}"


class EdsError(ValueError):
    """An EDS that cannot be used: all that is wrong with it, a line each."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(map(str, self.findings)))


def shorten(text: str) -> str:
    """Return a text of a file so that it fits into a line.

    >>> shorten("a" * 99) == "a" * 37 + "..."
    True
    """
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


Section = dict[str, str]

SECTIONS: Final = ("DeviceInfo", "DeviceComissioning")
"""Those that describe the device, beside its objects."""

_OBJECT: Final = re.compile(r"([0-9A-F]{4})(?:(SUB)([0-9A-F]{1,2})|(NAME|VALUE))?")
_DERIVED_TYPE: Final = re.compile(r"([0-9A-F]{1,3})SUB1")
_KNOWN_SECTIONS: Final = {
    **{name.lower(): name for name in SECTIONS},
    "devicecommissioning": "DeviceComissioning",
    "comments": "Comments",
}
_TITLE: Final = re.compile(r"\[([^\]]+)\]")
_OWN_WORD: Final = re.compile(r"(MaxBytes|DefaultBytes) of (\w+) is (\w+)")
_COMMENT: Final = re.compile(r"(^|\s);.*|^\s*#.*")


@mypyc_attr(serializable=True)
class EdsFile:
    """The sections of an EDS or DCF, in the spelling of CiA 306 whatever that of the file.

    It collects what is wrong: first its own lines, then what its readers find.
    A line that cannot be read matters only in a section that describes the device.

    Args:
        name: what findings call it.
        text: the whole file.

    Attributes:
        sections: texts by lower-case keyword, by section: `1017`, `1018sub1`, `DeviceInfo`.
        errors: what makes it another device than its author meant.
        warnings: what is not by the standard, and still has one meaning.
    """

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.sections: dict[str, Section] = {}
        self._errors: dict[Finding, None] = {}
        self._warnings: dict[Finding, None] = {}
        self._parse(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"))

    @property
    def errors(self) -> tuple[Finding, ...]:
        """All of them, each once, in the order in which they were found."""
        return tuple(self._errors)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """All of them, likewise."""
        return tuple(self._warnings)

    def refuse(self, section: str, reason: str) -> None:
        """Note an error."""
        self._errors[Finding(self.name, section, reason)] = None

    def warn(self, section: str, reason: str) -> None:
        """Note what is odd."""
        self._warnings[Finding(self.name, section, reason)] = None

    def value(self, section: str, key: str) -> str:
        """Return the text of a keyword, empty if it is not there."""
        return self.sections.get(section, {}).get(key.lower(), "")

    def has(self, section: str, key: str) -> bool:
        """Return whether a keyword is there, with a text or without."""
        return key.lower() in self.sections.get(section, {})

    def numeric(self, section: str, key: str) -> str:
        """Return the text of a number as CiA 306 writes it; a warning if the file does not."""
        text = self.value(section, key)
        plain = plain_numbers(text)
        if plain != text:
            self.warn(section, f"{key}={shorten(text)} is no number of CiA 306: {plain} is taken")
        return plain

    def number(
        self, section: str, key: str, default: int = 0, low: int = 0, high: int = 0xFFFF_FFFF
    ) -> int:
        """Return the number of a keyword.

        Where there is none the default counts: with a warning if the keyword is
        empty, with an error if it is no number from `low` to `high`.
        """
        text = self.numeric(section, key)
        if not text:
            if self.has(section, key):
                self.warn(section, f"{key} is empty: {default} is taken")
            return default
        try:
            number = parse_number(text)
        except ValueError:
            self.refuse(section, f"{key}={shorten(text)} is not a number")
            return default
        if low <= number <= high:
            return number
        self.refuse(section, f"{key}={shorten(text)} is not in {low}..{high}")
        return default

    def objects(self) -> Iterator[tuple[str, int, int | None]]:
        """Give the sections of objects, with index and sub-index; None for the object itself."""
        for section in self.sections:
            match = _OBJECT.fullmatch(section.upper())
            if match is not None and match[4] is None:
                yield section, int(match[1], 16), int(match[3], 16) if match[2] else None

    def _parse(self, lines: list[str]) -> None:
        title, section = "", Section()
        for number, raw in enumerate(lines, 1):
            line = _COMMENT.sub("", raw).strip()
            key, equals, text = line.partition("=")
            if match := _TITLE.match(line):
                title = canonical_section(match[1])
                section = self._begin(title, number)
            elif equals:
                self._add(section, title, (key.strip(), text.strip()), number)
            elif line and _matters(title) and (title or not self._errors):
                reason = f"line {number} is no keyword with a value: {shorten(line)!r}"
                self.refuse(title, reason)
        self._take_comments()

    def _take_comments(self) -> None:
        """Learn what CiA 306 has no keyword for from comments, as `write_eds` writes it."""
        for text in self.sections.get("Comments", {}).values():
            if match := _OWN_WORD.fullmatch(text):
                key, section, value = match.groups()
                self.sections.get(section, {}).setdefault(key.lower(), value)

    def _begin(self, title: str, line: int) -> Section:
        """Begin a section; one that is there already is not read again."""
        if title not in self.sections:
            return self.sections.setdefault(title, {})
        if _matters(title):
            self.refuse(title, f"is there twice, line {line}")
        return {}

    def _add(self, section: Section, title: str, item: tuple[str, str], line: int) -> None:
        key, text = item
        if key.lower() not in section:
            section[key.lower()] = text
        elif title and _matters(title):
            self.refuse(title, f"{key} is there twice, line {line}")


def decode_text(data: bytes) -> str:
    r"""Return the text of a file: UTF-8, or Windows-1252 as older editors write it.

    >>> decode_text("\ufeffµ".encode()), decode_text("µ".encode("cp1252"))
    ('µ', 'µ')
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def canonical_section(title: str) -> str:
    """Return the name of a section as CiA 306 spells it.

    >>> canonical_section("1a00SUB0A"), canonical_section("deviceinfo"), canonical_section("a0")
    ('1A00subA', 'DeviceInfo', 'a0')
    """
    if derived := _DERIVED_TYPE.fullmatch(title.upper()):
        return f"{derived[1]}sub1"
    match = _OBJECT.fullmatch(title.upper())
    if match is None:
        return _KNOWN_SECTIONS.get(title.lower(), title)
    index, sub, number, other = match.groups()
    return f"{index}sub{int(number, 16):X}" if sub else f"{index}{(other or '').capitalize()}"


def _matters(title: str) -> bool:
    """Return whether a section, or what stands before the first one, describes the device."""
    return not title or title in SECTIONS or _OBJECT.fullmatch(title.upper()) is not None
