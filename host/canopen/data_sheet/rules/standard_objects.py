"""The objects of the communication area: what CiA 301 says of their kind, types and access."""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType

U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
TEXT: Final = DataType.VISIBLE_STRING


class StandardObject(NamedTuple):
    """One object, or each of a range.

    Attributes:
        composed: it has sub-indices.
        types: data type by sub-index.
        others: that of the sub-indices not named, None where it may be any.
        fixed: nobody may write it.
    """

    composed: bool
    types: dict[int, DataType]
    others: DataType | None = None
    fixed: bool = False


def _variable(kind: DataType, *, fixed: bool = False) -> StandardObject:
    return StandardObject(False, {0: kind}, None, fixed)


def _composed(kind: DataType | None, *, fixed: bool = False, **types: DataType) -> StandardObject:
    subs = {int(name[1:]): each for name, each in types.items()}
    return StandardObject(True, {0: U8, **subs}, kind, fixed)


_PDO: Final = _composed(None, s1=U32, s2=U8, s3=U16, s5=U16, s6=U8)
_MAPPING: Final = _composed(U32)
_SDO: Final = _composed(None, s1=U32, s2=U32, s3=U8)

_SINGLE: Final = {
    **dict.fromkeys((0x1000, 0x1002), _variable(U32, fixed=True)),
    0x1001: _variable(U8, fixed=True),
    **dict.fromkeys((0x1005, 0x1006, 0x1007, 0x1012, 0x1014), _variable(U32)),
    **dict.fromkeys((0x1008, 0x1009, 0x100A), _variable(TEXT)),
    **dict.fromkeys((0x100C, 0x1015, 0x1017), _variable(U16)),
    **dict.fromkeys((0x100D, 0x1019), _variable(U8)),
    **dict.fromkeys((0x1003, 0x1010, 0x1011, 0x1016), _composed(U32)),
    0x1018: _composed(U32, fixed=True),
    0x1029: _composed(U8),
    0x1F80: _variable(U32),
}
_RANGES: Final = (
    (range(0x1200, 0x1300), _SDO),
    (range(0x1400, 0x1600), _PDO),
    (range(0x1600, 0x1800), _MAPPING),
    (range(0x1800, 0x1A00), _PDO),
    (range(0x1A00, 0x1C00), _MAPPING),
)


def standard_object(index: int) -> StandardObject | None:
    """Return what CiA 301 says of an object; None where it says nothing that is checked."""
    for area, found in _RANGES:
        if index in area:
            return found
    return _SINGLE.get(index)
