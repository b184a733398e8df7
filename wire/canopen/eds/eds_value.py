"""Lines, sections and values of an EDS file, as text."""

from __future__ import annotations

import re
import struct
from contextlib import suppress
from functools import lru_cache
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType, Value

# The lines of an EDS or DCF: section titles, keywords with values, comments (CiA 306).

_SECTIONS: Final = ("DeviceInfo", "DeviceComissioning")
"""Sections that describe the device, in addition to its objects."""

_NAMED: Final = (
    *_SECTIONS,
    *("FileInfo", "DummyUsage", "Comments", "DynamicChannels", "Tools"),
    *("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"),
    *("SupportedModules", "ConnectedModules"),
)
KNOWN_SECTIONS: Final = {
    **{name.lower(): name for name in _NAMED},
    "devicecommissioning": "DeviceComissioning",
}
"""Section names in CiA 306 spelling, by name in lower case."""

_OBJECT: Final = re.compile(r"([0-9A-F]{4})(?:(SUB)([0-9A-F]{1,2})|(NAME|VALUE|DENOTATION))?")
_LOOSE: Final = re.compile(
    r"(?:0X)?([0-9A-F]{4})[ _]*(?:(SUB)[ _]*0*([0-9A-F]{1,2})|(NAME|VALUE|DENOTATION))?"
)
"""Section titles as found in files: `1018 sub 1`, `0x1018`, `1018_sub_1`, `1018sub0001`."""
_DERIVED_TYPE: Final = re.compile(r"([0-9A-F]{1,3})SUB([123])")
_MODULE: Final = re.compile(
    r"M([0-9]+)(?:(MODULEINFO|COMMENTS|FIXEDOBJECTS|SUBEXTENDS)"
    r"|(FIXED|SUBEXT)([0-9A-F]{1,4})(?:SUB([0-9A-F]{1,2}))?)",
    re.ASCII,
)
"""Section titles of the modules of a modular device: `M1ModuleInfo`, `M1SubExt6000`."""
_MODULE_WORDS: Final = {
    word.upper(): word
    for word in ("ModuleInfo", "Comments", "FixedObjects", "SubExtends", "Fixed", "SubExt")
}
_TITLE: Final = re.compile(r"\[([^\]]+)\]")
_LINE_COMMENT: Final = re.compile(r"(^|\s);.*|^\s*#.*")


class EdsLine(NamedTuple):
    """A line of an EDS file with its parsed content.

    Attributes:
        number: line number, counted from 1.
        text: the line as written, without its end.
        section: section of the line in CiA 306 spelling, or empty before the first section.
        title: title, as written, if the line starts a section, or else empty.
        key: keyword of the line, or empty in other lines.
        value: value of the keyword, or empty in other lines. If the value contains `#` or `//`,
            these characters and the rest of the line are kept, because they may be part of a text.
        content: the line without a comment that begins with `;`, or with `#` at the start of the
            line.
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
        """Whether the line assigns a value; the name may be missing."""
        return "=" in self.content and not self.title


def _split_lines(text: str) -> list[str]:
    r"""Return the lines of a text, with any line ends.

    >>> _split_lines("a\r\nb\rc\nd")
    ['a', 'b', 'c', 'd']
    """
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def read_lines(text: str) -> list[EdsLine]:
    r"""Read all lines of a file.

    >>> [(line.section, line.key, line.value) for line in read_lines("[1a00SUB0]\nA=1 ;x")]
    [('1A00sub0', '', ''), ('1A00sub0', 'A', '1')]
    """
    lines, section = [], ""
    for number, raw in enumerate(_split_lines(text), 1):
        has_comment = ";" in raw or "#" in raw  # most have none
        content = (_LINE_COMMENT.sub("", raw) if has_comment else raw).strip()
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
    """Return the name of a section in CiA 306 spelling.

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
    """Return index and sub-index of a section that describes an object, or None.

    >>> object_section("1A00subA"), object_section("1017"), object_section("1600Value")
    ((6656, 10), (4119, None), None)
    """
    match = _OBJECT.fullmatch(section.upper())
    if match is None or match[4] is not None:
        return None
    return int(match[1], 16), int(match[3], 16) if match[2] else None


@lru_cache(maxsize=4096)
def describes_device(section: str) -> bool:
    """Return whether a section, or the part before the first section, describes the device."""
    if not section or section in _SECTIONS or _OBJECT.fullmatch(section.upper()):
        return True
    return is_module_object(section)


def is_module_object(section: str) -> bool:
    """Return whether a section describes an object of a module.

    >>> is_module_object("M1Fixed6000sub1"), is_module_object("M1SubExtends")
    (True, False)
    """
    module = _MODULE.fullmatch(section.upper())
    return module is not None and module[3] is not None


# Values in an EDS: numbers, `$NODEID` sums, texts and hexadecimal bytes (CiA 306).

_NODE_ID: Final = "$NODEID"
NODE_IDS: Final = (_NODE_ID, "NODEID")
"""Notations of the node-ID, also without the dollar sign."""

_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING, DataType.VISIBLE_CHAR)
BYTES: Final = (DataType.OCTET_STRING, DataType.DOMAIN)
FLOATS: Final = {DataType.REAL32: "f", DataType.REAL64: "d"}
TIMES: Final = (DataType.TIME_OF_DAY, DataType.TIME_DIFFERENCE)

_WIDEST: Final = 64
"""Number of bits of the widest number."""
_C_WIDTHS: Final = (8, 16, 32, 64)
"""Numbers of bits of the integers of C."""

_PLAIN: Final = re.compile(r"0x[0-9A-Fa-f]+|0|[1-9][0-9]*|", re.ASCII)
_C_SUFFIX: Final = re.compile(r"\b(0x[0-9a-f]+|[0-9]+)[ul]{1,3}\b", re.IGNORECASE | re.ASCII)
_SPLIT_HEX: Final = re.compile(r"0x((?: *[0-9a-f])+)", re.IGNORECASE | re.ASCII)
_ASSEMBLER_HEX: Final = re.compile(r"([0-9][0-9a-f ]*)h", re.IGNORECASE | re.ASCII)
_COMMENT: Final = re.compile(r"(?<!\s)\s*+(?:[#;]|//).*", re.DOTALL)
_HEX_BYTES: Final = re.compile(r"0x([0-9a-f]+)", re.IGNORECASE | re.ASCII)
_LONE_BYTES: Final = re.compile(
    r"0x[0-9a-f]{1,2}(?:[ ,]++0x[0-9a-f]{1,2})++", re.IGNORECASE | re.ASCII
)
_WHOLE: Final = re.compile(r"\+?(-?(?:0|[1-9][0-9]*+))(?:\.0++)?", re.ASCII)
_UNDERSCORE: Final = re.compile(r"(?<=[0-9a-f])_(?=[0-9a-f])", re.IGNORECASE)
_OCTAL: Final = re.compile(r"0[0-7]+")
_NO_OCTAL: Final = re.compile(r"\b0++(?=[0-7]*+[89])([0-9]++)\b", re.ASCII)
_TRUTH: Final = {"true": True, "false": False}


def without_comment(text: str) -> str:
    """Return a number or a word of an EDS file without a trailing comment.

    `#`, `//` and `;` start a comment, with or without a blank before them.

    >>> without_comment("0x07 # VAR"), without_comment("7//VAR"), without_comment("$NODEID+8;x")
    ('0x07', '7', '$NODEID+8')
    """
    if "#" not in text and ";" not in text and "//" not in text:  # most are such
        return text
    return _COMMENT.sub("", text, count=1)


def parse_value(kind: DataType, text: str) -> tuple[Value, bool]:
    """Read a value of an EDS file, such as a default, as a value of its data type.

    Args:
        kind: data type of the value.
        text: text, which is not empty.

    Returns:
        The value, and whether to add the node-ID (`$NODEID+...`).

    Raises:
        ValueError: the text is not a value of this type.

    >>> parse_value(DataType.UNSIGNED32, "$NODEID+0x180")
    (384, True)
    >>> parse_value(DataType.INTEGER8, "0xFF"), parse_value(DataType.INTEGER8, "0xFFFFFFFE")
    ((-1, False), (-2, False))
    >>> parse_value(DataType.UNSIGNED32, "-1") == (0xFFFF_FFFF, False)
    True
    >>> parse_value(DataType.REAL32, "0x3F800000")
    (1.0, False)
    """
    if kind in _TEXTS:
        return text, False
    if kind in BYTES:
        return _parse_bytes(text), False
    if kind in FLOATS:
        return _parse_float(FLOATS[kind], text), False
    if kind is DataType.BOOLEAN and text.lower() in _TRUTH:
        return _TRUTH[text.lower()], False
    number, relative = parse_sum(text)
    if kind in TIMES:
        return number.to_bytes(6, "little"), False
    return _twos_complement(kind, number), relative


def _twos_complement(kind: DataType, number: int) -> int:
    """Return the number of an integer type with the same bits as a number.

    A negative number of an unsigned type becomes its two's complement. For a signed type, an
    unsigned bit pattern with the width of the type or of a wider C type becomes the negative
    number. Other numbers are unchanged.

    >>> _twos_complement(DataType.UNSIGNED8, -128), _twos_complement(DataType.UNSIGNED8, -129)
    (128, -129)
    >>> _twos_complement(DataType.INTEGER16, 0xFFFF_8000)
    -32768
    >>> _twos_complement(DataType.INTEGER16, 65536)
    65536
    """
    bits = kind.bits
    half = 1 << bits - 1
    if not kind.signed:
        return number + 2 * half if bits > 1 and -half <= number < 0 else number
    if number < half:
        return number
    for width in (bits, *_C_WIDTHS):
        if -half <= number - (1 << width) < 0:
            return number - (1 << width)
    return number


def parse_number(text: str) -> int:
    """Read a number: decimal, hexadecimal with 0x, octal with a leading 0 (CiA 306).

    >>> parse_number("0x1F"), parse_number("31"), parse_number("037"), parse_number("-1")
    (31, 31, 31, -1)
    """
    if not text.isascii() or "_" in text:
        raise ValueError(f"{text!r} is no number")
    return int(text, 8) if _OCTAL.fullmatch(text) else int(text, 0)


def is_plain_number(text: str) -> bool:
    """Return whether a text is already a number in CiA 306 notation, or is empty.

    Nearly all numbers in EDS files have this notation, so this fast check saves their conversion.
    """
    return _PLAIN.fullmatch(text) is not None


def plain_numbers(text: str) -> str:
    """Convert a number to the notation of CiA 306.

    The function removes these parts: a suffix as in C (`0x80u`), blanks and underscores within the
    number, a comment after it, leading zeros if the number cannot be octal (`0009`), a plus sign,
    and decimals that are 0 (`5.0`). A hexadecimal number in the notation of assemblers (`1Ah`)
    becomes `0x1A`. The term `$NODEID` of a sum is not changed.

    >>> plain_numbers("0x1234567890ABCDEFLL"), plain_numbers("$NODEID+0x80u"), plain_numbers("0009")
    ('0x1234567890ABCDEF', '$NODEID+0x80', '9')
    >>> plain_numbers("0x 12 34"), plain_numbers("1Ah"), plain_numbers("1_000")
    ('0x1234', '0x1A', '1000')
    >>> plain_numbers("+5"), plain_numbers("-5.0"), plain_numbers("+0x5")
    ('5', '-5', '0x5')
    """
    if is_plain_number(text):  # a third of the time of a file
        return text
    plain = _NO_OCTAL.sub(r"\1", _C_SUFFIX.sub(r"\1", without_comment(text)))
    if assembler := _ASSEMBLER_HEX.fullmatch(plain):
        return f"0x{assembler[1].replace(' ', '')}"
    plain = _UNDERSCORE.sub("", plain)
    if whole := _WHOLE.fullmatch(plain):
        return whole[1]
    if plain[:3].lower() == "+0x":
        plain = plain[1:]
    return _SPLIT_HEX.sub(lambda match: "0x" + match[1].replace(" ", ""), plain)


def parse_limit(kind: DataType, text: str, *, upper: bool = True) -> int | float | None:
    """Read a LowLimit or HighLimit of an EDS file.

    Args:
        kind: data type of the limited value.
        text: text, which is not empty.
        upper: whether the limit is HighLimit, or else LowLimit.

    Returns:
        The limit. It may be outside the range of the data type: a HighLimit above the range, or a
        LowLimit below it, excludes no value and is returned unchanged. The result is None if values
        of this type have no limits, or if the limit depends on the node-ID.

    Raises:
        ValueError: the text is not a number of at most 64 bits.

    >>> parse_limit(DataType.UNSIGNED8, "-1"), parse_limit(DataType.INTEGER8, "0xFFFF")
    (255, 65535)
    >>> parse_limit(DataType.INTEGER8, "0xFF80", upper=False)
    -128
    """
    if kind in FLOATS:
        return _parse_float(FLOATS[kind], text)
    if not kind.is_integer or "NODEID" in text.upper():
        return None
    if kind is DataType.BOOLEAN and text.lower() in _TRUTH:
        return _TRUTH[text.lower()]
    number = parse_sum(text)[0]
    if number.bit_length() > _WIDEST:
        raise ValueError("no data type is that wide")
    if number >> kind.bits == 0 or kind.signed is not upper:
        return _twos_complement(kind, number)
    return number  # beyond the type on the side where that cuts nothing


def format_limit(kind: DataType, limit: int | float) -> str:
    """Return a limit as it is written to an EDS file.

    A limit of a float type is written as the hexadecimal bytes of the float, if these bytes
    represent the limit exactly. Other limits are written as decimal numbers.
    """
    with suppress(ValueError):
        if kind in FLOATS and kind.decode(data := kind.encode(limit)) == limit:
            return format_value(kind, data)
    return str(limit)


def format_value(kind: DataType, data: bytes, *, relative: bool = False) -> str:
    """Return a value as it is written to an EDS file.

    A float is written as its hexadecimal bytes, as Lely's tools require. Only a float whose bytes
    are all zero is written as `0`. Some values have no exact text in an EDS file. To detect such a
    value, the caller has to parse the returned text and compare the result with the value.

    Args:
        kind: data type of the value.
        data: bytes of the value.
        relative: whether the node-ID is added to the value.

    >>> format_value(DataType.UNSIGNED32, (0x180).to_bytes(4, "little"), relative=True)
    '$NODEID+0x180'
    >>> format_value(DataType.REAL32, bytes.fromhex("0000803F"))
    '0x3F800000'
    """
    value = kind.decode(data)
    if isinstance(value, bytes):
        return f"0x{int.from_bytes(data, 'little'):012X}" if kind in TIMES else data.hex().upper()
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return f"0x{data[::-1].hex().upper()}" if any(data) else "0"
    if kind.signed or kind is DataType.BOOLEAN:
        return str(value)
    return f"{_NODE_ID}+0x{value:X}" if relative else f"0x{value:0{2 * kind.size}X}"


def parse_sum(text: str) -> tuple[int, bool]:
    """Read a sum of numbers; also return whether the node-ID is part of it.

    >>> parse_sum("$NODEID+0x180"), parse_sum("5")
    ((384, True), (5, False))
    """
    terms = text.replace(" ", "").upper().split("+")
    numbers = [parse_number(term) for term in terms if term not in NODE_IDS]
    total: int = sum(numbers)
    return total, len(numbers) < len(terms)


def _parse_float(layout: str, text: str) -> float:
    """Read a decimal number, or the bytes of a float as a hexadecimal number."""
    if not text.lower().startswith("0x"):
        return float(text)
    data = int(text, 16).to_bytes(struct.calcsize(layout), "big")
    value: float = struct.unpack(">" + layout, data)[0]
    return value


def is_hex_bytes(text: str) -> bool:
    """Return whether a text is hexadecimal bytes in CiA 306 notation.

    >>> is_hex_bytes("01 02FF"), is_hex_bytes("0x0102"), is_hex_bytes("hello")
    (True, False, False)
    """
    with suppress(ValueError):
        return bytes.fromhex(text) is not None
    return False


def _parse_bytes(text: str) -> bytes:
    r"""Read hexadecimal bytes; some editors write 0x before all or each of them, or write a text.

    >>> _parse_bytes("0102"), _parse_bytes("0x0102"), _parse_bytes("0x0"), _parse_bytes("no")
    (b'\x01\x02', b'\x01\x02', b'\x00', b'no')
    >>> _parse_bytes("0x1 0xFF"), _parse_bytes("0x01,0x02"), _parse_bytes("01 02 # two")
    (b'\x01\xff', b'\x01\x02', b'\x01\x02')
    """
    said = without_comment(text)
    if said and is_hex_bytes(said):
        return bytes.fromhex(said)
    if digits := _HEX_BYTES.fullmatch(said):
        return bytes.fromhex(digits[1].rjust(len(digits[1]) + len(digits[1]) % 2, "0"))
    if _LONE_BYTES.fullmatch(said):
        return bytes(int(byte, 16) for byte in said.replace(",", " ").split())
    return text.encode()
