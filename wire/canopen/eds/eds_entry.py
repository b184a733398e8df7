"""One entry of an EDS or DCF: a variable, or an element of an array or record."""

from __future__ import annotations

import math
from typing import Final

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_file import EdsFile, shorten
from tickrig.wire.canopen.eds.eds_value import parse_limit, parse_value
from tickrig.wire.canopen.eds.object_table import (
    MAX_VARIABLE_BYTES,
    Access,
    EntryDescription,
    ObjectCode,
)

SIMPLE_TYPES: Final = range(0x1C)
ASCII_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.VISIBLE_CHAR)
TRUTH: Final = (0, 1)
TRUTH_WORDS: Final = {"yes": 1, "true": 1, "no": 0, "false": 0}
TYPE_WORDS: Final = {kind.name.lower(): int(kind) for kind in DataType}
KIND_WORDS: Final = {code.name.lower(): int(code) for code in ObjectCode}
LONE_LETTERS: Final = {"r": "ro", "w": "wo"}
MISSING: Final = {
    "ParameterName": "name-missing",
    "DataType": "data-type-missing",
    "AccessType": "access-missing",
}
"""The rule that a keyword left out breaks."""


def read_entry(
    file: EdsFile, section: str, index: int, sub: int, name: str | None = None
) -> EntryDescription:
    """Read an entry; what it lacks is noted, and what stands for it.

    Args:
        file: takes what is wrong.
        section: where the entry is described, its array's for a compact one.
        index: of its object.
        sub: sub-index.
        name: that of the file's `ParameterName` if left out.
    """
    if name is None:
        name = required(file, section, "ParameterName", "")
    kind, access = _data_type(file, section), _access(file, section)
    default, relative = _default(file, section, index, sub, kind)
    low, high = _limits(file, section, kind)
    return EntryDescription(
        *(index, sub, name, kind, access),
        default=default,
        low=low,
        high=high,
        relative=relative,
        max_bytes=file.number(section, "MaxBytes", MAX_VARIABLE_BYTES),
        unit=file.value(section, "Unit"),
        factor=_factor(file, section),
    )


def required(file: EdsFile, section: str, key: str, instead: str) -> str:
    """Return the text of a keyword that every entry has; `instead`, and a warning, without it."""
    if file.has(section, key):
        return file.value(section, key)
    taken = f"{instead} is taken" if instead else "none is taken"
    file.warn(section, f"{key} is missing: {taken}", MISSING[key])
    return instead


def is_visible_char(file: EdsFile, number: int) -> bool:
    """Return whether 00A0h is the data type of RTC-CANopen here, not one that the file derives."""
    return number == DataType.VISIBLE_CHAR and f"{number:X}sub1" not in file.sections


def _data_type(file: EdsFile, section: str) -> DataType:
    if file.number(section, "ObjectType", ObjectCode.VAR, words=KIND_WORDS) == ObjectCode.DOMAIN:
        return DataType.DOMAIN
    usual = DataType.UNSIGNED8 if section.endswith("sub0") else DataType.DOMAIN
    required(file, section, "DataType", usual.name)
    number = file.number(section, "DataType", usual, words=TYPE_WORDS)
    if number not in SIMPLE_TYPES and not is_visible_char(file, number):
        number = _derived(file, section, number)
    try:
        return DataType(number)
    except ValueError:
        return DataType(_unknown(file, section, number))


def _derived(file: EdsFile, section: str, number: int) -> int:
    """Return the type behind one of the file's own, as CanFestival writes them."""
    own = f"{number:X}sub1"
    if own in file.sections:
        return file.number(own, "DefaultValue", DataType.DOMAIN)
    return _unknown(file, section, number)


def _unknown(file: EdsFile, section: str, number: int) -> int:
    reason = f"DataType=0x{number:04X} is unknown: DOMAIN is taken"
    file.warn(section, reason, "data-type-unknown", "DataType")
    return DataType.DOMAIN


def _access(file: EdsFile, section: str) -> Access:
    text = required(file, section, "AccessType", "rw")
    known = LONE_LETTERS.get(text.lower(), text or "rw")
    mappable = bool(file.number(section, "PDOMapping", words=TRUTH_WORDS))
    try:
        access = Access.from_eds(known, mappable=mappable)
    except ValueError:
        known, access = "rw", Access.from_eds("rw", mappable=mappable)
    if known != text:
        what = f"AccessType={shorten(text)} is none of CiA 306" if text else "AccessType is empty"
        file.warn(section, f"{what}: {known} is taken", "access-form", "AccessType")
    return access


def _default(
    file: EdsFile, section: str, index: int, sub: int, kind: DataType
) -> tuple[bytes | None, bool]:
    """Return the power-on value of the file, and whether it is relative to the node-ID."""
    if file.value(section, "DefaultBytes"):
        return _exact(file, section, kind), False
    for place, key in (
        (section, "ParameterValue"),
        (f"{index:04X}Value", str(sub)),
        (section, "DefaultValue"),
    ):
        if file.value(place, key):
            return _value(file, place, key, kind)
    return None, False


def read_value_beside(
    file: EdsFile, index: int, sub: int, kind: DataType
) -> tuple[bytes | None, bool]:
    """Return the value that a DCF gives an entry without a section, None if it gives none.

    Args:
        file: takes what is wrong.
        index: of the object; the value stands in `[INDEXValue]`.
        sub: sub-index.
        kind: its data type.

    Returns:
        The bytes, and whether the node-ID is added to them.
    """
    place = f"{index:04X}Value"
    return _value(file, place, str(sub), kind) if file.value(place, str(sub)) else (None, False)


def _exact(file: EdsFile, section: str, kind: DataType) -> bytes | None:
    text = file.value(section, "DefaultBytes")
    try:
        data = bytes.fromhex(text)
        kind.decode(data)
    except ValueError:
        what = f"{kind.size} hexadecimal bytes" if kind.size else "hexadecimal bytes"
        reason = f"DefaultBytes={shorten(text)} is no {what}"
        file.refuse(section, reason, "default-value", "DefaultBytes")
        return None
    return data


def _value(file: EdsFile, section: str, key: str, kind: DataType) -> tuple[bytes | None, bool]:
    text = file.numeric(section, key) if kind.is_integer else file.value(section, key)
    try:
        if kind in ASCII_TEXTS and not text.isascii():
            return _foreign_text(file, section, key, kind), False
        value, relative = parse_value(kind, text)
        if kind is DataType.BOOLEAN and value not in TRUTH:
            reason = f"{key}={shorten(text)} is no BOOLEAN: 1 is taken"
            file.warn(section, reason, "boolean-value", key)
        return kind.encode(value), relative
    except (ValueError, OverflowError):
        file.refuse(section, f"{key}={shorten(text)} is no {kind.name}", "default-value", key)
        return None, False


def _foreign_text(file: EdsFile, section: str, key: str, kind: DataType) -> bytes:
    """Return the bytes of a text beyond ASCII: of ISO 8859-1 if it has them, else of UTF-8."""
    text = file.value(section, key)
    try:
        data, coding = kind.encode(text), "ISO 8859-1"
    except ValueError:
        data, coding = kind.encode(text.encode()), "UTF-8"
    reason = f"{key}={shorten(text)} is not ASCII: its bytes in {coding} are taken"
    file.warn(section, reason, "text-value", key)
    return data


def _limits(
    file: EdsFile, section: str, kind: DataType
) -> tuple[int | float | None, int | float | None]:
    """Return the limits of a number; other types have none."""
    low, high = _limit(file, section, "LowLimit", kind), _limit(file, section, "HighLimit", kind)
    if low is not None and high is not None and low > high:
        reason = f"LowLimit {low} is above HighLimit {high}: neither is taken"
        file.warn(section, reason, "limit-order", "LowLimit")
        return None, None
    return low, high


def _limit(file: EdsFile, section: str, key: str, kind: DataType) -> int | float | None:
    text = file.numeric(section, key) if kind.is_integer else file.value(section, key)
    try:
        return parse_limit(kind, text) if text else None
    except (ValueError, OverflowError):
        reason = f"{key}={shorten(text)} is no {kind.name}: no limit is taken"
        file.warn(section, reason, "limit-value", key)
        return None


def _factor(file: EdsFile, section: str) -> float:
    """Return the factor, which the canopen library reads too; it is of no standard."""
    text = file.value(section, "Factor")
    try:
        factor = float(text or 1)
    except ValueError:
        factor = 0.0
    if factor and math.isfinite(factor):
        return factor
    reason = f"Factor={shorten(text)} is no factor: 1 is taken"
    file.warn(section, reason, "factor", "Factor")
    return 1
