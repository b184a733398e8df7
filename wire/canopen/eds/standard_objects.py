"""The objects of the communication area: their kind, types and access (CiA 301, CiA 302)."""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType

U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
TEXT: Final = DataType.VISIBLE_STRING
BYTES: Final = DataType.OCTET_STRING


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


_PDO: Final = _composed(None, s1=U32, s2=U8, s3=U16, s4=U8, s5=U16, s6=U8)
_MAPPING: Final = _composed(U32)
_SDO: Final = _composed(None, s1=U32, s2=U32, s3=U8)

_SINGLE: Final = {
    **dict.fromkeys((0x1000, 0x1002), _variable(U32, fixed=True)),
    0x1001: _variable(U8, fixed=True),
    **dict.fromkeys((0x1005, 0x1006, 0x1007, 0x1012, 0x1013, 0x1014), _variable(U32)),
    **dict.fromkeys((0x100B, 0x100E, 0x100F), _variable(U32)),
    **dict.fromkeys((0x1008, 0x1009, 0x100A), _variable(TEXT)),
    **dict.fromkeys((0x100C, 0x1015, 0x1017, 0x1022), _variable(U16)),
    **dict.fromkeys((0x100D, 0x1019, 0x1024), _variable(U8)),
    **dict.fromkeys((0x1003, 0x1010, 0x1011, 0x1016, 0x1020, 0x1028), _composed(U32)),
    0x1018: _composed(U32, fixed=True),
    0x1021: _variable(DataType.DOMAIN),
    **dict.fromkeys((0x1023, 0x1025), _composed(BYTES, s2=U8)),
    **dict.fromkeys((0x1026, 0x1029), _composed(U8)),
    0x1027: _composed(U16),
    **dict.fromkeys((0x1F20, 0x1F22, 0x1F23, 0x1F50), _composed(DataType.DOMAIN)),
    **dict.fromkeys((0x1F21, 0x1F24, 0x1F51, 0x1F82, 0x1F83), _composed(U8)),
    **dict.fromkeys((0x1F26, 0x1F27, 0x1F52, 0x1F55, 0x1F56, 0x1F57), _composed(U32)),
    **dict.fromkeys((0x1F81, *range(0x1F84, 0x1F89)), _composed(U32)),
    **dict.fromkeys((0x1F80, 0x1F89), _variable(U32)),
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


def standard_type(index: int, sub: int, *, composed: bool) -> DataType | None:
    """Return the data type of an entry, None where the documents give none.

    Args:
        index: of the object.
        sub: sub-index.
        composed: whether it is described as an element, not as a variable.

    >>> standard_type(0x1017, 0, composed=False).name, standard_type(0x1A00, 8, composed=True).name
    ('UNSIGNED16', 'UNSIGNED32')
    >>> standard_type(0x2000, 0, composed=False), standard_type(0x1017, 1, composed=True)
    (None, None)
    """
    standard = standard_object(index)
    if standard is None or standard.composed is not composed:
        return None
    return standard.types.get(sub, standard.others)
