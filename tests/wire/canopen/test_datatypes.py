from __future__ import annotations

import pytest

from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.errors import FieldError


@pytest.mark.parametrize(
    ("kind", "value", "data"),
    [
        (DataType.BOOLEAN, True, "01"),
        (DataType.INTEGER24, -2, "FEFFFF"),
        (DataType.UNSIGNED56, 1, "01000000000000"),
        (DataType.REAL32, 1.5, "0000C03F"),
        (DataType.REAL64, -2.0, "00000000000000C0"),
        (DataType.VISIBLE_STRING, "aé", "61E9"),
        (DataType.UNICODE_STRING, "a✓", "61001327"),
        (DataType.OCTET_STRING, b"\x00\xff", "00FF"),
        (DataType.TIME_OF_DAY, bytes(6), "000000000000"),
    ],
)
def test_values_and_bytes_of_each_kind(kind: DataType, value: Value, data: str) -> None:
    assert kind.encode(value).hex().upper() == data
    assert kind.decode(bytes.fromhex(data)) == value


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (DataType.UNSIGNED8, 256),
        (DataType.INTEGER8, 1.5),
        (DataType.REAL32, "x"),
        (DataType.VISIBLE_STRING, "✓"),
        (DataType.DOMAIN, 5),
        (DataType.TIME_OF_DAY, bytes(5)),
    ],
)
def test_a_value_that_does_not_fit_is_refused(kind: DataType, value: Value) -> None:
    with pytest.raises(FieldError, match=f"is no {kind.name}"):
        kind.encode(value)


def test_bytes_of_the_wrong_number_are_refused() -> None:
    with pytest.raises(FieldError, match="3 bytes for UNSIGNED16, which has 2"):
        DataType.UNSIGNED16.decode(bytes(3))


@pytest.mark.parametrize("kind", [kind for kind in DataType if kind.is_integer])
def test_limits_are_what_just_fits(kind: DataType) -> None:
    lowest, highest = kind.limits
    assert highest - lowest == (1 << kind.bits) - 1
    for value, beyond in (lowest, lowest - 1), (highest, highest + 1):
        assert kind.decode(kind.encode(value)) == value
        if kind is not DataType.BOOLEAN:
            with pytest.raises(FieldError):
                kind.encode(beyond)
