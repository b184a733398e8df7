"""Profiles of DeviceRTCs: Table 4, places of ports, and what is refused (DECISION K5, K17)."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_canopen.port_types import (
    BOOLEAN,
    CHARACTER,
    DOUBLE,
    FLOAT,
    LONG,
    PORT_TYPES,
    SHORT,
    STRING,
    CanopenPortType,
    integer,
)
from tickrig.wire.rtc_canopen.profile import CanopenPortProfile, PortDirection, RtcProfile

# NEDO report, 3.4.43.3, Table 4: RTC, bits (0 where it varies), code.
TABLE_4 = """
Boolean 1 01, Octet 8 05, Character 8 A0, Short 16 03, UnsignedShort 16 06, Float 32 08,
Long 32 04, UnsignedLong 32 07, Double 64 11, UnsignedLongLong 64 1B, LongLong 64 15,
String 0 09, WideCharacter 0 0B, WideString 0 0B
"""


def port(
    name: str, kind: CanopenPortType[Any], direction: PortDirection = PortDirection.IN
) -> CanopenPortProfile:
    return CanopenPortProfile(name, direction, kind)


def profile(*ports: CanopenPortProfile, **given: Any) -> RtcProfile:
    return RtcProfile(**{"type_name": "Mine", "ports": ports, **given})


def test_port_types_are_those_of_table_4() -> None:
    rows = [row.split() for row in TABLE_4.strip().replace("\n", " ").split(",")]
    assert [
        (name, kind.data_type.bits, f"{kind.data_type:02X}") for name, kind in PORT_TYPES.items()
    ] == [(name, int(bits), code) for name, bits, code in rows]


@pytest.mark.parametrize(("bits", "kind"), [(8, "02"), (16, "03"), (32, "04")])
def test_integer_follows_the_word_of_the_device(bits: int, kind: str) -> None:
    assert f"{integer(bits).data_type:02X}" == kind


def test_a_word_that_no_integer_has_is_refused() -> None:
    with pytest.raises(ValueError, match="a word of 24 bits; Integer has 8, 16 or 32"):
        integer(24)


@given(st.lists(st.integers(-(2**15), 2**15 - 1), min_size=4, max_size=4))
def test_a_sequence_comes_back(values: list[int]) -> None:
    kind = SHORT.sequence(4)
    assert kind.decode(kind.encode(tuple(values))) == tuple(values)


@pytest.mark.parametrize(
    ("kind", "value", "data"),
    [
        (BOOLEAN, True, "01"),
        (CHARACTER, "é", "E9"),
        (LONG, -2, "FEFFFFFF"),
        (FLOAT, 1.5, "0000C03F"),
        (DOUBLE, -2.0, "00000000000000C0"),
    ],
)
def test_a_value_goes_there_and_back(kind: CanopenPortType[Any], value: object, data: str) -> None:
    assert kind.encode(value) == (bytes.fromhex(data),)
    back = kind.decode([bytes.fromhex(data)])
    assert (back, type(back)) == (value, type(value))


@pytest.mark.parametrize("value", ["", "ab", "✓", 65])
def test_what_is_not_one_character_is_refused(value: Any) -> None:
    with pytest.raises(FieldError):
        CHARACTER.encode(value)


def test_a_sequence_takes_as_many_elements_as_it_has() -> None:
    with pytest.raises(FieldError, match="2 elements of Short, 3 are needed"):
        SHORT.sequence(3).encode((1, 2))
    with pytest.raises(ValueError, match="a sequence of 0 elements, at least 1 is needed"):
        SHORT.sequence(0)


def test_ports_have_objects_and_pdos_in_order_of_declaration() -> None:
    mine = profile(
        port("a", SHORT.sequence(2)),
        port("b", BOOLEAN, PortDirection.OUT),
        port("c", LONG),
    )
    rows = [(p.profile.name, p.index, p.number, p.cob_id, p.mapping) for p in mine.placed()]
    assert rows == [
        ("a", 0x2100, 1, 0x200, (0x2100_0110, 0x2100_0210)),
        ("b", 0x2101, 1, 0x180, (0x2101_0008,)),
        ("c", 0x2102, 2, 0x300, (0x2102_0020,)),
    ]
    assert [p.profile.name for p in mine.placed(PortDirection.IN)] == ["a", "c"]


def test_a_version_is_the_revision_number() -> None:
    assert profile(version="3.12.1").revision == 0x3_000C


def test_a_product_code_is_given_or_the_crc_of_the_name() -> None:
    assert profile(product_code=7).code == 7
    assert RtcProfile(type_name="x123456789"[:1]).code == 0x8CDC1683  # CRC-32 of "x"


NAME = "is not a letter and up to 31 letters, digits and underscores"


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"type_name": "2nd"}, f"type_name '2nd' {NAME}"),
        ({"type_name": "x" * 33}, f"type_name '{'x' * 33}' {NAME}"),
        ({"version": "1"}, "version '1' is not like 1.0 or 1.0.2"),
        ({"version": "70000.0"}, "version '70000.0' is not like"),
        ({"vendor": "a;b"}, "vendor 'a;b' is not one line of ASCII"),
        ({"category": "a\nb"}, "category 'a\\nb' is not one line of ASCII"),
        ({"rate_hz": 0}, "rate_hz 0 is not in 1..1000"),
        ({"product_code": 2**32}, "product_code 4294967296 is not in 0..0xFFFFFFFF"),
        ({"ports": (port("a b", SHORT),)}, f"port 'a b' {NAME}"),
        (
            {"ports": (port("a", SHORT), port("a", LONG, PortDirection.OUT))},
            "2 ports are called 'a'",
        ),
        (
            {"ports": tuple(port(f"p{n}", SHORT, PortDirection.OUT) for n in range(5))},
            "5 out-ports; 4 have a COB-ID",
        ),
        ({"ports": (port("a", STRING),)}, "port a: String does not fit a PDO; use an SDO"),
        (
            {"ports": (port("a", SHORT.sequence(5)),)},
            "port a: 5 x Short are 80 bits, a PDO has 64",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(given: dict[str, Any], reason: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the text is compared below
        profile(**given)
    assert str(caught.value).startswith(reason)


def test_a_character_is_no_data_type_of_cia_301_but_has_a_byte() -> None:
    assert (DataType.VISIBLE_CHAR.size, DataType.VISIBLE_CHAR.is_integer) == (1, False)
    assert DataType.VISIBLE_CHAR.decode(b"\xe9") == "é"
