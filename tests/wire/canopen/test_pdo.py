from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.pdo import (
    Dispatched,
    MappedObject,
    Mpdo,
    PdoDescription,
    Scanned,
    fields,
    pack_bits,
    unpack_bits,
)
from tickrig.wire.errors import FieldError, FramingError

FIELDS = st.lists(
    st.integers(1, 64).flatmap(
        lambda bits: st.tuples(st.integers(0, (1 << bits) - 1), st.just(bits))
    ),
    max_size=64,
)
U32 = st.integers(0, 0xFFFF_FFFF)


def test_a_mapping_entry_of_the_reference_dictionary() -> None:
    assert MappedObject.parse(0x6411_0210) == MappedObject(0x6411, 2, 16)


def test_a_pdo_says_what_it_carries() -> None:
    pdo = PdoDescription(0x8000_0205, (0x6040_0010, 0x0005_0008, 0x2000_0103))
    assert (pdo.can_id, pdo.enabled, pdo.size) == (0x205, False, 4)
    assert PdoDescription(0x205).enabled
    assert list(fields(pdo.mapping)) == [
        (MappedObject(0x6040, 0, 16), 0),
        (MappedObject(0x0005, 0, 8), 16),
        (MappedObject(0x2000, 1, 3), 24),
    ]


def test_a_scanner_list_entry() -> None:
    assert Scanned.parse(0x0260_0001) == Scanned(0x6000, 1, block=2)


def test_a_dispatching_list_entry() -> None:
    assert Dispatched.parse(0x0362_0001_3000_0709) == Dispatched(9, 0x3000, 7, 0x6200, 1, 3)


@given(U32)
def test_mapping_and_scanner_entries_round_trip(value: int) -> None:
    assert MappedObject.parse(value).encode() == value
    assert Scanned.parse(value).encode() == value


@given(st.integers(0, (1 << 64) - 1))
def test_dispatching_entries_round_trip(value: int) -> None:
    assert Dispatched.parse(value).encode() == value


@given(st.binary(min_size=8, max_size=8))
def test_mpdos_round_trip(data: bytes) -> None:
    assert Mpdo.parse(data).encode() == data


def test_an_mpdo_is_padded() -> None:
    assert Mpdo(True, 5, 0x2000, 1, b"\x07").encode().hex() == "8500200107000000"


@pytest.mark.parametrize("size", [0, 7, 9])
def test_an_mpdo_has_eight_bytes(size: int) -> None:
    with pytest.raises(FramingError, match="an MPDO has 8"):
        Mpdo.parse(bytes(size))


def test_an_mpdo_carries_four_bytes() -> None:
    with pytest.raises(FieldError, match="5 bytes, an MPDO carries 4"):
        Mpdo(False, 5, 0x2000, 0, bytes(5))


@pytest.mark.parametrize("node_id", [-1, 128])
def test_an_mpdo_has_a_node_id_of_seven_bits(node_id: int) -> None:
    with pytest.raises(FieldError, match=r"is not in 0\.\.127"):
        Mpdo(False, node_id, 0x2000, 0, b"")


@pytest.mark.unmeasured
@given(FIELDS)
def test_bits_round_trip(fields: list[tuple[int, int]]) -> None:
    data = pack_bits(fields)
    assert len(data) == (sum(bits for _, bits in fields) + 7) // 8
    assert unpack_bits(data, (bits for _, bits in fields)) == tuple(value for value, _ in fields)


def test_what_does_not_fit_is_cut_off() -> None:
    assert pack_bits(((0x1FF, 8), (0, 8))) == b"\xff\x00"


def test_missing_bits_are_0() -> None:
    assert unpack_bits(b"\xff", (4, 8)) == (0xF, 0xF)
