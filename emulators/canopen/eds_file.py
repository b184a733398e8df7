"""An electronic data sheet as sections of keywords (CiA 306)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from configparser import DuplicateOptionError, DuplicateSectionError, ParsingError, RawConfigParser
from pathlib import Path
from typing import Final

from tickrig.wire.canopen.eds_value import parse_number

Section = dict[str, str]

KEYWORDS: Final = (
    *("ParameterName", "ObjectType", "DataType", "AccessType", "DefaultValue", "ParameterValue"),
    *("PDOMapping", "LowLimit", "HighLimit", "SubNumber", "CompactSubObj", "ObjFlags"),
    *("StorageLocation", "NrOfEntries", "MaxBytes", "DefaultBytes"),
    *("VendorName", "ProductName", "OrderCode", "NodeID", "Baudrate", "NodeName"),
    *(f"BaudRate_{rate}" for rate in (10, 20, 50, 125, 250, 500, 800, 1000)),
)
SECTIONS: Final = ("DeviceInfo", "DeviceComissioning", "DummyUsage", "FileInfo")

_OBJECT: Final = re.compile(r"([0-9A-F]{4})(?:(SUB)([0-9A-F]{1,2})|(NAME|VALUE))?")
_KNOWN_KEYWORDS: Final = {name.lower(): name for name in KEYWORDS}
_KNOWN_SECTIONS: Final = {
    **{name.lower(): name for name in SECTIONS},
    "devicecommissioning": "DeviceComissioning",
}


class EdsError(ValueError):
    """An EDS that cannot be used: file, section and reason in one line."""

    def __init__(self, file: str, section: str, reason: str) -> None:
        super().__init__(f"{file}: [{section}] {reason}" if section else f"{file}: {reason}")
        self.file, self.section, self.reason = file, section, reason


class EdsFile:
    """The sections of an EDS or DCF, in the spelling of CiA 306 whatever that of the file.

    Args:
        name: what errors call it.
        text: the whole file.

    Raises:
        EdsError: not sections of keywords, or one of them twice.

    Attributes:
        sections: keywords by section: `1017`, `1018sub1`, `3004Name`, `DeviceInfo`.
    """

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.sections: dict[str, Section] = {}
        parser = self._parser(text)
        for title in parser.sections():
            section = canonical_section(title)
            if section in self.sections:
                raise self.error(section, "is there twice")
            self.sections[section] = {
                _KNOWN_KEYWORDS.get(key.lower(), key): value for key, value in parser.items(title)
            }

    @classmethod
    def read(cls, path: Path) -> EdsFile:
        """Read a file in UTF-8, or Windows-1252 as older editors write it; OSError if it fails."""
        data = path.read_bytes()
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", "replace")
        return cls(str(path), text.replace("\r\n", "\n"))

    def error(self, section: str, reason: str) -> EdsError:
        """Make an error about a section."""
        return EdsError(self.name, section, reason)

    def value(self, section: str, key: str) -> str:
        """Return the text of a keyword, empty if it is not there."""
        return self.sections.get(section, {}).get(key, "")

    def number(self, section: str, key: str, default: int = 0) -> int:
        """Return the number of a keyword, the default if it is empty or not there."""
        text = self.value(section, key)
        try:
            return parse_number(text) if text else default
        except ValueError as error:
            raise self.error(section, f"{key}={text} is not a number") from error

    def objects(self) -> Iterator[tuple[str, int, int | None]]:
        """Give the sections of objects, with index and sub-index; None for the object itself."""
        for section in self.sections:
            match = _OBJECT.fullmatch(section.upper())
            if match is not None and match[4] is None:
                yield section, int(match[1], 16), int(match[3], 16) if match[2] else None

    def _parser(self, text: str) -> RawConfigParser:
        parser = RawConfigParser(inline_comment_prefixes=(";",))
        parser.optionxform = str  # type: ignore[assignment,method-assign] # as the docs say
        try:
            parser.read_string(text)
        except DuplicateSectionError as error:
            raise self.error(error.section, f"is there twice, line {error.lineno}") from error
        except DuplicateOptionError as error:
            reason = f"{error.option} is there twice, line {error.lineno}"
            raise self.error(error.section, reason) from error
        except ParsingError as error:
            line = _first_bad_line(error)
            got = text.split("\n")[line - 1].strip()
            reason = f"line {line} is no keyword with a value: {got!r}"
            raise self.error(_section_above(text, line), reason) from error
        return parser


def canonical_section(title: str) -> str:
    """Return the name of a section as CiA 306 spells it.

    >>> canonical_section("1a00SUB0A"), canonical_section("deviceinfo"), canonical_section("A0")
    ('1A00subA', 'DeviceInfo', 'A0')
    """
    match = _OBJECT.fullmatch(title.upper())
    if match is None:
        return _KNOWN_SECTIONS.get(title.lower(), title)
    index, sub, number, other = match.groups()
    return f"{index}sub{int(number, 16):X}" if sub else f"{index}{(other or '').capitalize()}"


def _first_bad_line(error: ParsingError) -> int:
    """Return the number of the line that could not be read."""
    lineno = getattr(error, "lineno", None)  # a missing section header has it
    return int(lineno if lineno is not None else error.errors[0][0])


def _section_above(text: str, line: int) -> str:
    """Return the section that a line belongs to."""
    titles = re.findall(r"^\[(.+)\]", "\n".join(text.split("\n")[: line - 1]), re.MULTILINE)
    return str(titles[-1]) if titles else ""
