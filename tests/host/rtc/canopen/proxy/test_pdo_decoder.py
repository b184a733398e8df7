"""Reading a PDO at once gives what reading it object by object gives."""

from __future__ import annotations

from collections.abc import Mapping
from struct import Struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc.canopen.pdo_layout import PDO_FIELD_TYPES, PdoLayout, lay_out, pdo_decoder
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.pdo import MappedObject

DUMMIES = [(0x05, 8), (0x06, 16), (0x01, 1), (0x07, 32)]
OBJECTS = st.one_of(
    st.tuples(st.just(0x2100), st.sampled_from(sorted(PDO_FIELD_TYPES))),
    st.tuples(st.just(0x0005), st.sampled_from(DUMMIES)),
)


def laid_out(objects: list[tuple[int, tuple[int, int]]]) -> PdoLayout:
    mapping = [MappedObject(index, sub, bits) for sub, (index, (_, bits)) in enumerate(objects)]
    types: Mapping[tuple[int, int], int] = {
        (index, sub): code for sub, (index, (code, _)) in enumerate(objects)
    }
    return lay_out(0x1800, 0x181, tuple(mapping), types)


@given(st.lists(OBJECTS, max_size=8), st.binary(max_size=64))
def test_the_values_are_the_same(objects: list[tuple[int, tuple[int, int]]], data: bytes) -> None:
    layout = laid_out(objects)
    data = data.ljust(layout.size, b"\xa5")
    assert repr(pdo_decoder(layout)(data)) == repr(layout.decode(data))  # also of NaN, -0.0, True


@pytest.mark.parametrize(
    ("objects", "at_once"),
    [
        ([(0x2100, (DataType.INTEGER16, 16))] * 4, True),
        ([(0x2100, (DataType.BOOLEAN, 8)), (0x2100, (DataType.REAL32, 32))], True),
        ([(0x0005, (DataType.UNSIGNED8, 8)), (0x2100, (DataType.UNSIGNED8, 8))], True),
        ([(0x2100, (DataType.BOOLEAN, 1)), (0x2100, (DataType.UNSIGNED8, 8))], False),
        ([(0x0005, (DataType.BOOLEAN, 1)), (0x2100, (DataType.UNSIGNED8, 8))], False),
        ([(0x2100, (DataType.DOMAIN, 8))], False),
    ],
)
def test_whole_numbers_of_bytes_are_read_at_once(
    objects: list[tuple[int, tuple[int, int]]], at_once: bool
) -> None:
    decoder = pdo_decoder(laid_out(objects))
    assert isinstance(getattr(decoder, "__self__", None), Struct) is at_once
