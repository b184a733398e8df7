"""Values of objects as people write them.

>>> encode_value(ObjectText("target_velocity", DataType.INTEGER32), "-2").hex()
'feffffff'
>>> encode_value(ObjectText("angle", DataType.INTEGER16, "deg", 0.1), "1.5").hex()
'0f00'
>>> encode_value(ObjectText(), "37 02").hex()
'3702'
"""

from __future__ import annotations

from math import isfinite
from typing import Final

from tickrig.host.monitor.decode.object_text import ObjectText
from tickrig.host.text.values import parse_setting
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError

TEXTS: Final = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING, DataType.VISIBLE_CHAR)
TRUTH: Final = {"true": 1, "false": 0}


def encode_value(text: ObjectText, words: str) -> bytes:
    """Return the bytes of a value, written as the table shows it: in the unit of the object.

    Args:
        text: what is known of the object; where no type is, bytes are written.
        words: the value; bytes in hex.

    Raises:
        ValueError: not a value of this object.
    """
    kind = text.kind
    if kind in TEXTS:
        return kind.encode(words)
    if kind is None or not (kind.is_integer or kind in (DataType.REAL32, DataType.REAL64)):
        return _bytes(words)
    value = TRUTH.get(words.lower(), parse_setting(words))
    if isinstance(value, str):
        raise ValueError(f"{words!r} is no number; {text.name} is {kind.name}")
    try:
        return kind.encode(_on_the_wire(text, kind, value))
    except (FieldError, OverflowError):
        raise ValueError(f"{words} is not in the range of {kind.name}") from None


def _on_the_wire(text: ObjectText, kind: DataType, value: float) -> float:
    """Return the number that is sent: the nearest step, where the object has a factor."""
    if text.factor == 1 or text.in_hex:
        return value
    scaled = value / text.factor
    return round(scaled) if kind.is_integer and isfinite(scaled) else scaled


def _bytes(words: str) -> bytes:
    try:
        return bytes.fromhex(words)
    except ValueError:
        raise ValueError(
            f"{words!r} is not bytes in hex, as 37 02; the type is not known"
        ) from None
