"""Values of ports as text in JSON, which is parsed without evaluating code.

A struct is an object with its fields. Any other value stands for the `data` of a struct with a
time, which is set to the current time:

>>> from tickrig.wire.rtc_types.rtc import TimedLong
>>> read_literal(TimedLong, 5, now_us=1_500_000)
TimedLong(tm=Time(sec=1, nsec=500000000), data=5)
>>> literal(_)
{'tm': {'sec': 1, 'nsec': 500000000}, 'data': 5}
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Annotated, Any, Final, TypeVar, get_args, get_origin, get_type_hints

from tickrig.host.rtc.states import RtcRefused
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.cdr import encode
from tickrig.wire.rtc_types.idl import Primitive, Struct
from tickrig.wire.rtc_types.rtc import Time

S = TypeVar("S", bound=Struct)


def literal(value: object) -> object:
    """Convert a value for `json.dumps`. Octets become numbers, and enumerators become names."""
    match value:
        case Struct():
            return {name: literal(getattr(value, name)) for name in value.__match_args__}
        case tuple() | bytes():
            return [literal(element) for element in value]
        case IntEnum():
            return value.name
        case _:
            return value


def read_literal(kind: type[S], given: object, now_us: int) -> S:
    """Convert a JSON value to a struct that a data port can transfer.

    Missing fields have their default.

    Args:
        kind: struct type to create.
        given: value as `json.loads` returns it.
        now_us: time in us for a struct with a time stamp, if the JSON value has none.

    Raises:
        RtcRefused: the value does not fit the struct.
    """
    names = kind.__match_args__
    if "data" in names and not (isinstance(given, dict) and "data" in given):
        given = {"data": given}
    if "tm" in names and isinstance(given, dict) and "tm" not in given:
        given = {"tm": literal(Time.from_us(now_us)), **given}
    value: S = _struct(kind, given, kind.__name__)
    try:
        encode(value)
    except FieldError as error:
        raise RtcRefused(str(error)) from error
    return value


def _struct(kind: type[S], given: object, place: str) -> S:
    if not isinstance(given, dict):
        raise _refused(place, f"an object with {', '.join(kind.__match_args__)}", given)
    hints = get_type_hints(kind, include_extras=True)
    for name in given:
        if name not in kind.__match_args__:
            raise RtcRefused(f"{place} has no {name!r}; fields: {', '.join(kind.__match_args__)}")
    return kind(
        **{name: _field(hints[name], part, f"{place}.{name}") for name, part in given.items()}
    )


def _field(hint: Any, given: object, place: str) -> object:
    if get_origin(hint) is Annotated:
        return _primitive(get_args(hint)[1], given, place)
    if get_origin(hint) is tuple:
        return tuple(
            _field(get_args(hint)[0], part, f"{place}[{n}]")
            for n, part in enumerate(_list(given, place))
        )
    if issubclass(hint, IntEnum):
        return _enumerator(hint, given, place)
    return _struct(hint, given, place)


def _primitive(kind: Primitive, given: object, place: str) -> object:
    if kind is Primitive.OCTET_SEQ:
        return _octets(given, place)
    taken, what, make = _LITERAL_TYPES.get(kind, _WHOLE)
    if not isinstance(given, taken) or (isinstance(given, bool) and taken is not bool):
        raise _refused(place, f"{what} ({kind.value})", given)
    try:
        return make(given)
    except OverflowError:
        raise _refused(place, f"{what} ({kind.value})", given) from None


def _octets(given: object, place: str) -> bytes:
    octets = [part for part in _list(given, place) if type(part) is int and 0 <= part <= 0xFF]
    if octets != given:
        raise _refused(place, "octets 0..255", given)
    return bytes(octets)


def _list(given: object, place: str) -> list[object]:
    if not isinstance(given, list):
        raise _refused(place, "a list", given)
    return given


def _enumerator(kind: type[IntEnum], given: object, place: str) -> IntEnum:
    for enumerator in kind:
        if given == enumerator.name or (type(given) is int and given == enumerator):
            return enumerator
    raise _refused(place, f"one of {', '.join(kind.__members__)}", given)


def _refused(place: str, wanted: str, given: object) -> RtcRefused:
    return RtcRefused(f"{place} takes {wanted}, not {json.dumps(given)[:60]}")


_LiteralType = tuple[type | tuple[type, ...], str, Callable[[Any], object]]

_WHOLE: Final[_LiteralType] = (int, "a whole number", int)
_NUMBER: Final[_LiteralType] = ((int, float), "a number", float)
_TEXT: Final[_LiteralType] = (str, "a string", str)
_LITERAL_TYPES: Final[Mapping[Primitive, _LiteralType]] = {
    Primitive.BOOLEAN: (bool, "true or false", bool),
    Primitive.FLOAT: _NUMBER,
    Primitive.DOUBLE: _NUMBER,
    **dict.fromkeys((Primitive.CHAR, Primitive.WCHAR, Primitive.STRING, Primitive.WSTRING), _TEXT),
}
