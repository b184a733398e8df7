"""The lines of an EDS or DCF: section titles, keywords with values, comments (CiA 306)."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final, NamedTuple

SECTIONS: Final = ("DeviceInfo", "DeviceComissioning")
"""Those that describe the device, beside its objects."""

_NAMED: Final = (
    *SECTIONS,
    *("FileInfo", "DummyUsage", "Comments", "DynamicChannels", "Tools"),
    *("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"),
    *("SupportedModules", "ConnectedModules"),
)
KNOWN_SECTIONS: Final = {
    **{name.lower(): name for name in _NAMED},
    "devicecommissioning": "DeviceComissioning",
}
"""The spelling of CiA 306 by the name in lower case."""

_OBJECT: Final = re.compile(r"([0-9A-F]{4})(?:(SUB)([0-9A-F]{1,2})|(NAME|VALUE|DENOTATION))?")
_LOOSE: Final = re.compile(
    r"(?:0X)?([0-9A-F]{4})[ _]*(?:(SUB)[ _]*0*([0-9A-F]{1,2})|(NAME|VALUE|DENOTATION))?"
)
"""Titles as people write them: `1018 sub 1`, `0x1018`, `1018_sub_1`, `1018sub0001`."""
_DERIVED_TYPE: Final = re.compile(r"([0-9A-F]{1,3})SUB([123])")
_MODULE: Final = re.compile(
    r"M([0-9]+)(?:(MODULEINFO|COMMENTS|FIXEDOBJECTS|SUBEXTENDS)"
    r"|(FIXED|SUBEXT)([0-9A-F]{1,4})(?:SUB([0-9A-F]{1,2}))?)",
    re.ASCII,
)
"""Titles of what modules of a modular device have: `M1ModuleInfo`, `M1SubExt6000`."""
_MODULE_WORDS: Final = {
    word.upper(): word
    for word in ("ModuleInfo", "Comments", "FixedObjects", "SubExtends", "Fixed", "SubExt")
}
_TITLE: Final = re.compile(r"\[([^\]]+)\]")
_COMMENT: Final = re.compile(r"(^|\s);.*|^\s*#.*")


class EdsLine(NamedTuple):
    """One line, and what it says.

    Attributes:
        number: 1 for the first line of a file.
        text: the line as it stands there, without its end.
        section: that it begins or stands in, as CiA 306 spells it; empty before the first.
        title: of the section that it begins, as it stands there; empty elsewhere.
        key: of a keyword, empty elsewhere.
        value: of a keyword; `#` and `//` stay there, for a text may have them.
        content: what is left of it without a comment.
    """

    number: int
    text: str
    section: str
    title: str = ""
    key: str = ""
    value: str = ""
    content: str = ""

    @property
    def is_keyword(self) -> bool:
        """Whether it gives a keyword a value; the name may be missing."""
        return "=" in self.content and not self.title


def split_lines(text: str) -> list[str]:
    r"""Return the lines of a text, whatever ends them.

    >>> split_lines("a\r\nb\rc\nd")
    ['a', 'b', 'c', 'd']
    """
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def read_lines(text: str) -> list[EdsLine]:
    r"""Read all lines of a file.

    >>> [(line.section, line.key, line.value) for line in read_lines("[1a00SUB0]\nA=1 ;x")]
    [('1A00sub0', '', ''), ('1A00sub0', 'A', '1')]
    """
    lines, section = [], ""
    for number, raw in enumerate(split_lines(text), 1):
        has_comment = ";" in raw or "#" in raw  # most have none
        content = (_COMMENT.sub("", raw) if has_comment else raw).strip()
        match = _TITLE.match(content)
        if match:
            section = canonical_section(match[1])
            lines.append(EdsLine(number, raw, section, match[1], content=content))
            continue
        key, equals, value = content.partition("=")
        if not equals:
            key = ""
        lines.append(EdsLine(number, raw, section, "", key.strip(), value.strip(), content))
    return lines


@lru_cache(maxsize=4096)  # each line of a section asks: a tenth of the time of a file
def canonical_section(title: str) -> str:
    """Return the name of a section as CiA 306 spells it.

    >>> canonical_section("1a00SUB0A"), canonical_section("deviceinfo"), canonical_section("a0")
    ('1A00subA', 'DeviceInfo', 'a0')
    >>> canonical_section("1018 sub 1"), canonical_section("0x1018")
    ('1018sub1', '1018')
    >>> canonical_section("1018sub0001")
    '1018sub1'
    >>> canonical_section("m1fixed6000SUB01"), canonical_section("m1subextends")
    ('M1Fixed6000sub1', 'M1SubExtends')
    """
    title = title.strip()
    if module := _MODULE.fullmatch(title.upper()):
        number, listing, kind, index, sub = module.groups()
        head = f"M{int(number)}{_MODULE_WORDS[listing or kind]}"
        of_object = f"{int(index, 16):04X}" if index else ""
        return f"{head}{of_object}" + (f"sub{int(sub, 16):X}" if sub else "")
    if derived := _DERIVED_TYPE.fullmatch(title.upper()):
        return f"{derived[1]}sub{derived[2]}"
    match = _LOOSE.fullmatch(title.upper())
    if match is None:
        return KNOWN_SECTIONS.get(title.lower(), title)
    index, sub, number, other = match.groups()
    return f"{index}sub{int(number, 16):X}" if sub else f"{index}{(other or '').capitalize()}"


@lru_cache(maxsize=4096)
def object_section(section: str) -> tuple[int, int | None] | None:
    """Return index and sub-index of a section that describes an object; None for another one.

    >>> object_section("1A00subA"), object_section("1017"), object_section("1600Value")
    ((6656, 10), (4119, None), None)
    """
    match = _OBJECT.fullmatch(section.upper())
    if match is None or match[4] is not None:
        return None
    return int(match[1], 16), int(match[3], 16) if match[2] else None


@lru_cache(maxsize=4096)
def describes_device(section: str) -> bool:
    """Return whether a section, or what stands before the first one, describes the device."""
    if not section or section in SECTIONS or _OBJECT.fullmatch(section.upper()):
        return True
    return is_module_object(section)


def is_module_object(section: str) -> bool:
    """Return whether a section describes an object of a module.

    >>> is_module_object("M1Fixed6000sub1"), is_module_object("M1SubExtends")
    (True, False)
    """
    module = _MODULE.fullmatch(section.upper())
    return module is not None and module[3] is not None
