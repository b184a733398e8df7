"""Entries of an EDS or DCF object: a variable, or the elements of an array or record."""

from __future__ import annotations

import math
from collections.abc import Iterator
from operator import attrgetter
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds import eds_value, object_table
from tickrig.wire.canopen.eds.eds_file import EdsFile, shorten
from tickrig.wire.canopen.eds.eds_writer import VARIABLES

# The objects of the communication area: their kind, types and access (CiA 301, CiA 302).

_U8: Final = DataType.UNSIGNED8
_U16: Final = DataType.UNSIGNED16
_U32: Final = DataType.UNSIGNED32
_TEXT: Final = DataType.VISIBLE_STRING
_OCTETS: Final = DataType.OCTET_STRING


class StandardObject(NamedTuple):
    """The rules of CiA 301 for an object, or for each object in a range, to check an EDS.

    Attributes:
        composed: whether the object has sub-indices.
        types: data types by sub-index.
        others: data type of the other sub-indices, or None for any type.
        fixed: whether the object is read-only.
    """

    composed: bool
    types: dict[int, DataType]
    others: DataType | None = None
    fixed: bool = False


def _variable(kind: DataType, *, fixed: bool = False) -> StandardObject:
    return StandardObject(False, {0: kind}, None, fixed)


def _composed(kind: DataType | None, *, fixed: bool = False, **types: DataType) -> StandardObject:
    subs = {int(name[1:]): each for name, each in types.items()}
    return StandardObject(True, {0: _U8, **subs}, kind, fixed)


_PDO: Final = _composed(None, s1=_U32, s2=_U8, s3=_U16, s4=_U8, s5=_U16, s6=_U8)
_MAPPING: Final = _composed(_U32)
_SDO: Final = _composed(None, s1=_U32, s2=_U32, s3=_U8)

_SINGLE: Final = {
    **dict.fromkeys((0x1000, 0x1002), _variable(_U32, fixed=True)),
    0x1001: _variable(_U8, fixed=True),
    **dict.fromkeys((0x1005, 0x1006, 0x1007, 0x1012, 0x1013, 0x1014), _variable(_U32)),
    **dict.fromkeys((0x100B, 0x100E, 0x100F), _variable(_U32)),
    **dict.fromkeys((0x1008, 0x1009, 0x100A), _variable(_TEXT)),
    **dict.fromkeys((0x100C, 0x1015, 0x1017, 0x1022), _variable(_U16)),
    **dict.fromkeys((0x100D, 0x1019, 0x1024), _variable(_U8)),
    **dict.fromkeys((0x1003, 0x1010, 0x1011, 0x1016, 0x1020, 0x1028), _composed(_U32)),
    0x1018: _composed(_U32, fixed=True),
    0x1021: _variable(DataType.DOMAIN),
    **dict.fromkeys((0x1023, 0x1025), _composed(_OCTETS, s2=_U8)),
    **dict.fromkeys((0x1026, 0x1029), _composed(_U8)),
    0x1027: _composed(_U16),
    **dict.fromkeys((0x1F20, 0x1F22, 0x1F23, 0x1F50), _composed(DataType.DOMAIN)),
    **dict.fromkeys((0x1F21, 0x1F24, 0x1F51, 0x1F82, 0x1F83), _composed(_U8)),
    **dict.fromkeys((0x1F26, 0x1F27, 0x1F52, 0x1F55, 0x1F56, 0x1F57), _composed(_U32)),
    **dict.fromkeys((0x1F81, *range(0x1F84, 0x1F89)), _composed(_U32)),
    **dict.fromkeys((0x1F80, 0x1F89), _variable(_U32)),
}
_RANGES: Final = (
    (range(0x1200, 0x1300), _SDO),
    (range(0x1400, 0x1600), _PDO),
    (range(0x1600, 0x1800), _MAPPING),
    (range(0x1800, 0x1A00), _PDO),
    (range(0x1A00, 0x1C00), _MAPPING),
)


def standard_object(index: int) -> StandardObject | None:
    """Return the rules of CiA 301 for the object with an index, or None if there are no rules."""
    for area, found in _RANGES:
        if index in area:
            return found
    return _SINGLE.get(index)


def _standard_type(index: int, sub: int, *, composed: bool) -> DataType | None:
    """Return the data type of an entry, or None if the standards do not define it.

    Args:
        index: index of the object.
        sub: sub-index of the entry.
        composed: whether the entry is described as an element, not as a variable.

    >>> _standard_type(0x1017, 0, composed=False).name
    'UNSIGNED16'
    >>> _standard_type(0x1A00, 8, composed=True).name
    'UNSIGNED32'
    >>> _standard_type(0x2000, 0, composed=False), _standard_type(0x1017, 1, composed=True)
    (None, None)
    """
    standard = standard_object(index)
    if standard is None or standard.composed is not composed:
        return None
    return standard.types.get(sub, standard.others)


_SIMPLE_TYPES: Final = range(0x1C)
_NUMBERS: Final = (*eds_value.FLOATS, *eds_value.TIMES)
"""Data types of numbers that are not integers."""
_ASCII_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.VISIBLE_CHAR)
_TRUTH: Final = (0, 1)
_TRUTH_WORDS: Final = {"yes": 1, "true": 1, "no": 0, "false": 0}
_TYPE_WORDS: Final = {kind.name.lower(): int(kind) for kind in DataType}
_KIND_WORDS: Final = {code.name.lower(): int(code) for code in object_table.ObjectCode}
HIGHEST_SUB: Final = 254
_NO_DATA: Final = (0, object_table.ObjectCode.DEFTYPE, object_table.ObjectCode.DEFSTRUCT)
"""Kinds of objects without a value: NULL, and definitions of data types."""
_DESCRIBED: Final = (*VARIABLES, object_table.ObjectCode.ARRAY, object_table.ObjectCode.RECORD)
_ERROR_FIELD: Final = 0x1003
COUNTS: Final = (_ERROR_FIELD, *range(0x1600, 0x1800), *range(0x1A00, 0x1C00))
"""Objects whose sub-index 0 counts the used entries, not the existing ones."""
LONE_LETTERS: Final = {"r": "ro", "w": "wo"}
_MISSING: Final = {
    "ParameterName": "name-missing",
    "DataType": "data-type-missing",
    "AccessType": "access-missing",
}
"""Rules that missing keywords violate, by keyword."""


def read_entry(
    file: EdsFile, section: str, index: int, sub: int, name: str | None = None
) -> object_table.EntryDescription:
    """Read the description of one entry from its section of an EDS.

    If a keyword is missing, a default value is used, and a warning or error that names this value
    is added to `file`.

    Args:
        file: the EDS, which collects errors and warnings.
        section: section of the entry. For an entry of a compact array, it is the section of the
            array.
        index: index of the object.
        sub: sub-index of the entry.
        name: name of the entry, or None to use the file's `ParameterName`.
    """
    if name is None:
        name = _required(file, section, "ParameterName", "")
    derived = _data_type(file, section, index, sub)
    kind, access = derived.kind, _access(file, section)
    default, relative = _default(file, section, index, sub, derived)
    low, high = _limits(file, section, kind)
    return object_table.EntryDescription(
        *(index, sub, name, kind, access),
        default=default,
        low=derived.low if low is None else low,
        high=derived.high if high is None else high,
        relative=relative,
        max_bytes=file.number(section, "MaxBytes", derived.max_bytes),
        unit=file.value(section, "Unit"),
        factor=_factor(file, section),
    )


def _required(file: EdsFile, section: str, key: str, instead: str) -> str:
    """Return the text of a mandatory keyword; if it is missing, warn and return `instead`."""
    if file.has(section, key):
        return file.value(section, key)
    taken = f"{instead} is taken" if instead else "none is taken"
    file.warn(section, f"{key} is missing: {taken}", _MISSING[key])
    return instead


class _Type(NamedTuple):
    """A data type, whether the file defines the type, and the limits of a derived type."""

    kind: DataType
    is_said: bool = True
    low: int | float | None = None
    high: int | float | None = None
    max_bytes: int = object_table.MAX_VARIABLE_BYTES


def _data_type(file: EdsFile, section: str, index: int, sub: int) -> _Type:
    if (
        file.number(section, "ObjectType", object_table.ObjectCode.VAR, words=_KIND_WORDS)
        == object_table.ObjectCode.DOMAIN
    ):
        return _Type(DataType.DOMAIN)
    usual = _usual_type(section, index, sub)
    _required(file, section, "DataType", usual.name)
    number = file.number(section, "DataType", usual, words=_TYPE_WORDS)
    if number not in _SIMPLE_TYPES and (own := _own_type(file, number)) is not None:
        return _derived(file, section, number, own)
    kind = _known_type(file, section, number, usual)
    return _Type(kind, number == kind and bool(file.word(section, "DataType")))


def _usual_type(section: str, index: int, sub: int) -> DataType:
    """Return the data type of an object in CiA 301, or DOMAIN if it has none."""
    if section.endswith("sub0"):
        return DataType.UNSIGNED8
    composed = bool(sub) or not section.endswith(f"{index:04X}")
    return _standard_type(index, sub, composed=composed) or DataType.DOMAIN


def _derived(file: EdsFile, section: str, number: int, own: tuple[str, str, str]) -> _Type:
    """Return the base type of a data type that the file defines, as CanFestival does.

    Sub-index 1 is the type. Sub-indices 2 and 3 are the smallest and the largest number. For a
    string, sub-index 2 is the length.
    """
    said = file.number(own[0], "DefaultValue", DataType.DOMAIN)
    kind = _known_type(file, section if said == number else own[0], said)
    low, high, length = None, None, object_table.MAX_VARIABLE_BYTES
    if kind.size:
        low, high = (_limit(file, bound, "DefaultValue", kind) for bound in own[1:])
    else:
        length = file.number(own[1], "DefaultValue", length)
    bounds = "" if low is None and high is None else f" of {low} to {high}"
    most = "" if length == object_table.MAX_VARIABLE_BYTES else f" of at most {length} bytes"
    if kind is not DataType.DOMAIN:
        taken = f"{kind.name}{bounds}{most}"
        reason = f"DataType=0x{number:04X} is derived in [{own[0]}]: {taken} is taken"
        file.warn(section, reason, "data-type-derived", "DataType")
    return _Type(kind, True, low, high, length)


def _own_type(file: EdsFile, number: int) -> tuple[str, str, str] | None:
    """Return the sections that derive a data type, or None if the file does not derive it."""
    for form in (f"{number:X}", f"{number:04X}"):
        if file.value(f"{form}sub1", "DefaultValue"):
            return f"{form}sub1", f"{form}sub2", f"{form}sub3"
    return None


def _known_type(
    file: EdsFile, section: str, number: int, usual: DataType = DataType.DOMAIN
) -> DataType:
    try:
        return DataType(number)
    except ValueError:
        reason = f"DataType=0x{number:04X} is unknown: {usual.name} is taken"
        file.warn(section, reason, "data-type-unknown", "DataType")
        return usual


def _access(file: EdsFile, section: str) -> object_table.Access:
    _required(file, section, "AccessType", "rw")
    text = file.word(section, "AccessType") if file.has(section, "AccessType") else "rw"
    known = LONE_LETTERS.get(text.lower(), text or "rw")
    mappable = bool(file.number(section, "PDOMapping", words=_TRUTH_WORDS))
    try:
        access = object_table.Access.from_eds(known, mappable=mappable)
    except ValueError:
        known, access = "rw", object_table.Access.from_eds("rw", mappable=mappable)
    if known != text:
        what = f"AccessType={shorten(text)} is not in CiA 306" if text else "AccessType is empty"
        file.warn(section, f"{what}: {known} is taken", "access-form", "AccessType")
    return access


def _default(
    file: EdsFile, section: str, index: int, sub: int, said: _Type
) -> tuple[bytes | None, bool]:
    """Return the power-on value in the file, and whether it is relative to the node-ID."""
    kind = said.kind
    if file.value(section, "DefaultBytes"):
        return _exact(file, section, kind), False
    for place, key in (
        (section, "ParameterValue"),
        (f"{index:04X}Value", str(sub)),
        (section, "DefaultValue"),
    ):
        if _text(file, place, key, kind):
            if key == "ParameterValue" and not file.is_dcf:
                reason = f"{key} stands in an EDS: it is taken, not DefaultValue"
                file.warn(section, reason, "dcf-key", key)
            return _value(file, place, key, kind, is_said=said.is_said)
    return None, False


def _text(file: EdsFile, section: str, key: str, kind: DataType) -> str:
    """Return the text of a value. A number is in CiA 306 notation, without a comment."""
    if kind.is_integer:
        return file.numeric(section, key)
    return file.word(section, key) if kind in _NUMBERS else file.value(section, key)


def read_value_beside(
    file: EdsFile, index: int, sub: int, kind: DataType
) -> tuple[bytes | None, bool]:
    """Return the value that a DCF gives to an entry of a compact array.

    A compact array has one section for all its entries. The DCF gives the values of the entries in
    another section, `[INDEXValue]`.

    Args:
        file: the DCF, which collects errors.
        index: index of the object.
        sub: sub-index of the entry.
        kind: data type of the value.

    Returns:
        A pair. Its first item is the value as bytes, or None if the DCF has no value for the entry.
        Its second item is true if the node-ID must be added to the value.
    """
    place = f"{index:04X}Value"
    said = _text(file, place, str(sub), kind)
    return _value(file, place, str(sub), kind) if said else (None, False)


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


def _value(
    file: EdsFile, section: str, key: str, kind: DataType, *, is_said: bool = True
) -> tuple[bytes | None, bool]:
    text = _text(file, section, key, kind)
    try:
        if kind in _ASCII_TEXTS and not text.isascii():
            return _foreign_text(file, section, key, kind), False
        value, relative = eds_value.parse_value(kind, text)
        if kind is DataType.BOOLEAN and value not in _TRUTH:
            reason = f"{key}={shorten(text)} is no BOOLEAN: 1 is taken"
            file.warn(section, reason, "boolean-value", key)
        if is_said:
            _check_form(file, section, key, kind, text, value)
        return kind.encode(value), relative
    except (ValueError, OverflowError):
        file.refuse(section, f"{key}={shorten(text)} is no {kind.name}", "default-value", key)
        return None, False


def _check_form(  # noqa: PLR0913, PLR0917 - a place, its text and what it is
    file: EdsFile, section: str, key: str, kind: DataType, text: str, value: Value
) -> None:
    """Warn of a value with a clear meaning that is not in CiA 306 notation."""
    if kind in eds_value.BYTES and isinstance(value, bytes) and not eds_value.is_hex_bytes(text):
        what = "its text" if value == text.encode() else value.hex(" ").upper()
        reason = f"{key}={shorten(text)} is no hexadecimal bytes: {what} is taken"
        file.warn(section, reason, "byte-form", key)
    elif kind.is_integer and kind is not DataType.BOOLEAN and isinstance(value, int):
        may_differ = (value < 0) is not ("-" in text)
        number = eds_value.parse_sum(text)[0] if may_differ else value
        if number != value and number >> kind.bits:
            taken = str(value) if kind.signed else f"0x{value:0{2 * kind.size}X}"
            reason = f"{key}={shorten(text)} is no {kind.name}: {taken} is taken"
            file.warn(section, reason, "value-sign", key)


def _foreign_text(file: EdsFile, section: str, key: str, kind: DataType) -> bytes:
    """Return the bytes of a text beyond ASCII, in ISO 8859-1 if possible, or else in UTF-8."""
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
    """Return the limits of a number; other types have no limits."""
    low, high = _limit(file, section, "LowLimit", kind), _limit(file, section, "HighLimit", kind)
    if low is not None and high is not None and low > high:
        reason = f"LowLimit {low} is above HighLimit {high}: neither is taken"
        file.warn(section, reason, "limit-order", "LowLimit")
        return None, None
    return low, high


def _limit(file: EdsFile, section: str, key: str, kind: DataType) -> int | float | None:
    text = _text(file, section, key, kind)
    try:
        limit = eds_value.parse_limit(kind, text, upper=key != "LowLimit") if text else None
    except (ValueError, OverflowError):
        reason = f"{key}={shorten(text)} is no {kind.name}: no limit is taken"
        file.warn(section, reason, "limit-value", key)
        return None
    if limit is None and kind.is_integer and "NODEID" in text.upper():
        reason = f"{key}={shorten(text)} depends on the node-ID: no limit is taken"
        file.warn(section, reason, "limit-value", key)
    if isinstance(limit, int) and kind is not DataType.BOOLEAN:
        _check_form(file, section, key, kind, text, limit)
    return limit


def _factor(file: EdsFile, section: str) -> float:
    """Return the factor, from a non-standard keyword that the canopen library also reads."""
    text = file.word(section, "Factor")
    try:
        factor = float(text or 1)
    except ValueError:
        factor = 0.0
    if factor and math.isfinite(factor):
        return factor
    reason = f"Factor={shorten(text)} is no factor: 1 is taken"
    file.warn(section, reason, "factor", "Factor")
    return 1


def object_kind(file: EdsFile, section: str, with_subs: bool) -> object_table.ObjectCode | None:
    """Return the kind of an object; an object with sub-indices is never a variable."""
    usual = object_table.ObjectCode.RECORD if with_subs else object_table.ObjectCode.VAR
    number = file.number(section, "ObjectType", usual, words=_KIND_WORDS)
    if number in _NO_DATA:
        return None
    if number not in _DESCRIBED:
        reason = f"ObjectType={number} is no kind of object: {usual.name} is taken"
    elif with_subs and number in VARIABLES:
        reason = f"ObjectType={number} has no sub-indices, and there are: RECORD is taken"
    else:
        return object_table.ObjectCode(number)
    file.warn(section, reason, "object-type", "ObjectType")
    return usual


def read_object(
    file: EdsFile, head: str, index: int, kind: object_table.ObjectCode, subs: list[tuple[str, int]]
) -> Iterator[object_table.EntryDescription]:
    """Yield the descriptions of all entries of one object of an EDS.

    If the object has a compact description (CompactSubObj), sections of sub-indices override it.

    Args:
        file: the EDS, which collects errors.
        head: section of the object.
        index: index of the object.
        kind: object code: variable, array, record and others.
        subs: sections of the sub-indices, each with its sub-index.
    """
    if kind in VARIABLES:
        yield read_entry(file, head, index, 0)
        return
    if head in file.sections:
        _required(file, head, "ParameterName", "")
    described = [read_entry(file, section, index, sub) for section, sub in subs]
    count = min(file.number(head, "CompactSubObj"), HIGHEST_SUB)
    if file.value(head, "ParameterValue") and not count:
        reason = f"ParameterValue belongs to a sub-index of the {kind.name}: it is skipped"
        file.warn(head, reason, "value-place", "ParameterValue")
    if count:
        if kind is object_table.ObjectCode.RECORD:
            reason = "CompactSubObj in a RECORD: its entries are taken to be alike"
            file.warn(head, reason, "compact-record", "CompactSubObj")
        known = {row.sub for row in described}
        described += [row for row in _compact(file, head, index, count) if row.sub not in known]
    yield from sorted(described, key=attrgetter("sub"))


def _compact(
    file: EdsFile, head: str, index: int, count: int
) -> Iterator[object_table.EntryDescription]:
    """Read a compact object, described by one of its elements."""
    title = file.value(head, "ParameterName")
    elements = []
    for sub in range(1, count + 1):
        name = file.value(f"{head}Name", str(sub)) or f"{title}{sub}"
        elements.append(read_entry(file, head, index, sub, name))
    yield count_of(index, elements)
    yield from elements


def count_of(
    index: int, elements: list[object_table.EntryDescription]
) -> object_table.EntryDescription:
    """Make the sub-index 0 of a compact object."""
    u8 = DataType.UNSIGNED8
    if index == _ERROR_FIELD:
        return object_table.EntryDescription(
            index, 0, "Number of errors", u8, object_table.RW, default=0
        )
    used, access = len(elements), object_table.RO
    if index in COUNTS:
        used = sum(any(element.default) for element in elements)
        access = (
            object_table.RW
            if any(object_table.Access.WRITE in element.access for element in elements)
            else object_table.RO
        )
    return object_table.EntryDescription(index, 0, "Number of entries", u8, access, default=used)
