r"""Data types of a gateway: what a client writes for the bytes of an object (CiA 309-3).

>>> encode("i16", ["-2"]).hex(), decode("i16", b"\xfe\xff"), decode("x16", b"\x92\x01")
('feff', '-2', '0x0192')
>>> decode("vs", b"abc"), decode("", b"\x01\xAB")
('"abc"', '01 AB')
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from binascii import Error
from collections.abc import Sequence
from math import isnan
from typing import Final

from tickrig.host.canopen.gateway.gateway_error import ErrorCode, GatewayError
from tickrig.host.canopen.gateway.request import one_of
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError

HEX: Final = "hex"
"""Bytes; of CANopenNode, and what is shown where no type is said."""

NUMBERS: Final = {
    "b": DataType.BOOLEAN,
    "i8": DataType.INTEGER8,
    "i16": DataType.INTEGER16,
    "i24": DataType.INTEGER24,
    "i32": DataType.INTEGER32,
    "i40": DataType.INTEGER40,
    "i48": DataType.INTEGER48,
    "i56": DataType.INTEGER56,
    "i64": DataType.INTEGER64,
    "u8": DataType.UNSIGNED8,
    "u16": DataType.UNSIGNED16,
    "u24": DataType.UNSIGNED24,
    "u32": DataType.UNSIGNED32,
    "u40": DataType.UNSIGNED40,
    "u48": DataType.UNSIGNED48,
    "u56": DataType.UNSIGNED56,
    "u64": DataType.UNSIGNED64,
    "x8": DataType.UNSIGNED8,
    "x16": DataType.UNSIGNED16,
    "x32": DataType.UNSIGNED32,
    "x64": DataType.UNSIGNED64,
    "r32": DataType.REAL32,
    "r64": DataType.REAL64,
}
REALS: Final = ("r32", "r64")
BASE64: Final = ("os", "us", "d")
STRING: Final = "vs"
NAMES: Final = (*NUMBERS, STRING, *BASE64, HEX)
_UNSHOWN: Final = str.maketrans("", "", "\0\r\n")


def data_type(word: str) -> str:
    """Return the name of a data type, in lower case; GatewayError if it is none."""
    return one_of(word, NAMES, "data type")


def encode(name: str, words: Sequence[str]) -> bytes:
    """Return the bytes of a value.

    Args:
        name: of `NAMES`.
        words: the value as the client has written it; one but for `hex`.

    Raises:
        GatewayError: it is no value of this type.
    """
    text = " ".join(words)
    try:
        if name == HEX:
            return bytes.fromhex(text)
        (word,) = words
        if name == STRING:
            return word.encode("latin-1")
        if name in BASE64:
            return b64decode(word, validate=True)
        return NUMBERS[name].encode(float(word) if name in REALS else _integer(word))
    except (ValueError, FieldError, Error):
        raise GatewayError(ErrorCode.SYNTAX, f"{text!r} is no value of type {name}") from None


def decode(name: str, data: bytes) -> str:
    """Return what is shown of the bytes of an object; in hexadecimal if they are not of the type.

    Args:
        name: of `NAMES`, empty where the client names none.
        data: the bytes.
    """
    if name == STRING:
        return '"' + data.decode("latin-1").translate(_UNSHOWN).replace('"', '""') + '"'
    if name in BASE64:
        return b64encode(data).decode("ascii")
    if name in ("", HEX) or len(data) != NUMBERS[name].size:
        return data.hex(" ").upper()
    value = NUMBERS[name].decode(data)
    if isinstance(value, float):
        return "nan" if isnan(value) else f"{value:g}"
    if name.startswith("x") and isinstance(value, int):
        return f"0x{value:0{2 * len(data)}X}"
    return str(value)


def _integer(word: str) -> int:
    digits = word.removeprefix("-")
    if not (digits.isascii() and digits.isalnum()):
        raise ValueError(word)
    value = int(digits, 16) if digits[:2].lower() == "0x" else int(digits)
    return -value if word.startswith("-") else value
