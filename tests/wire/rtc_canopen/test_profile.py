"""Profiles of DeviceRTCs: Table 4, places of ports, and what is refused (DECISION K5, K17)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_canopen import (
    BOOLEAN,
    CHARACTER,
    DOUBLE,
    FLOAT,
    LONG,
    OCTET,
    PORT_TYPES,
    SHORT,
    STRING,
    WIDE_CHARACTER,
    WIDE_STRING,
    CanopenPortProfile,
    CanopenPortType,
    PortDirection,
    PortTransport,
    RtcProfile,
    integer,
    object_table,
)

# NEDO report, 3.4.43.3, Table 4: RTC, bits (0 where it varies), code.
TABLE_4 = """
Boolean 1 01, Octet 8 05, Character 8 A0, Short 16 03, UnsignedShort 16 06, Float 32 08,
Long 32 04, UnsignedLong 32 07, Double 64 11, UnsignedLongLong 64 1B, LongLong 64 15,
String 0 09, WideCharacter 16 0B, WideString 0 0B
"""


def port(
    name: str, kind: CanopenPortType[Any], direction: PortDirection = PortDirection.IN
) -> CanopenPortProfile:
    return CanopenPortProfile(name, direction, kind)


def special(name: str, kind: CanopenPortType[Any], **given: Any) -> CanopenPortProfile:
    return CanopenPortProfile(name, PortDirection.IN, kind, **given)


def profile(*ports: CanopenPortProfile, **given: Any) -> RtcProfile:
    return RtcProfile(**{"type_name": "Mine", "ports": ports, **given})


def test_port_types_are_those_of_table_4() -> None:
    rows = [row.split() for row in TABLE_4.strip().replace("\n", " ").split(",")]
    assert [
        (name, kind.element_bits, f"{kind.data_type:02X}") for name, kind in PORT_TYPES.items()
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
        (WIDE_CHARACTER, "猫", "2B73"),
        (STRING, "grüß", "6772FCDF"),
        (WIDE_STRING, "猫\U0001f408", "2B733DD808DC"),
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


@pytest.mark.parametrize("value", ["", "ab", "\U0001f408", 65])
def test_what_is_not_one_wide_character_of_16_bits_is_refused(value: Any) -> None:
    with pytest.raises(FieldError):
        WIDE_CHARACTER.encode(value)


@pytest.mark.parametrize("kind", [STRING, WIDE_STRING])
def test_a_text_has_255_characters_at_most(kind: CanopenPortType[str]) -> None:
    assert len(kind.encode("x" * 255)[0]) == kind.max_bytes
    with pytest.raises(FieldError, match="String, which has at most 255 characters"):
        kind.encode("x" * 256)


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
        ("b", 0x2101, 1, 0x180, (0x2101_0001,)),
        ("c", 0x2102, 2, 0x300, (0x2102_0020,)),
    ]
    assert [p.profile.name for p in mine.placed(PortDirection.IN)] == ["a", "c"]


@pytest.mark.parametrize(
    ("count", "dummies"), [(1, 7), (3, 5), (8, 0), (9, 7), (57, 7), (60, 4), (64, 0)]
)
def test_booleans_have_a_bit_each_and_dummies_fill_the_last_byte_of_an_rpdo(
    count: int, dummies: int
) -> None:
    kind = BOOLEAN.sequence(count)
    got, sent = profile(port("a", kind), port("b", kind, PortDirection.OUT)).placed()
    subs = range(1, count + 1) if count > 1 else (0,)
    bits = [0x2100_0001 | sub << 8 for sub in subs]
    assert got.mapping == (*bits, *[0x0001_0001] * dummies)
    assert sent.mapping == tuple(bit + 0x1_0000 for bit in bits)


def test_what_no_pdo_carries_goes_by_sdo_and_takes_no_pdo() -> None:
    mine = profile(
        port("a", STRING),
        port("b", SHORT),
        port("c", DOUBLE.sequence(2)),
        CanopenPortProfile("d", PortDirection.IN, SHORT, transport=PortTransport.SDO),
        CanopenPortProfile("e", PortDirection.IN, WIDE_CHARACTER, transport=PortTransport.PDO),
    )
    assert [(place.index, place.number) for place in mine.placed()] == [
        *((0x2100, 0), (0x2101, 1), (0x2102, 0), (0x2103, 0), (0x2104, 2)),
    ]
    assert [place.profile.name for place in mine.placed(PortDirection.IN)] == ["b", "e"]
    assert [one.by_sdo for one in mine.ports] == [True, False, True, True, False]


def test_the_fifth_pdo_is_off_until_somebody_names_its_cob_id() -> None:
    named = CanopenPortProfile("named", PortDirection.OUT, SHORT, cob_id=0x2A5)
    first = CanopenPortProfile("first", PortDirection.OUT, SHORT, cob_id=0x1FF)
    others = [port(f"p{n}", SHORT, PortDirection.OUT) for n in range(4)]
    mine = profile(first, *others, named)
    assert [(place.number, place.cob_id, place.relative) for place in mine.placed()] == [
        *((1, 0x1FF, False), (2, 0x280, True), (3, 0x380, True), (4, 0x480, True)),
        *((5, None, False), (6, 0x2A5, False)),
    ]
    defaults = {(row.index, row.sub): row for row in object_table(mine)}
    cob_ids = [defaults[0x1800 + n, 1] for n in range(6)]
    assert [int.from_bytes(row.power_on_data(16), "little") for row in cob_ids] == [
        *(0x1FF, 0x290, 0x390, 0x490, 0x8000_0000, 0x2A5)
    ]


def test_there_are_512_pdos_each_way() -> None:
    kinds = [port(f"p{n}", OCTET, direction) for direction in PortDirection for n in range(512)]
    ports = [replace(one, name=f"{one.direction.value}{one.name}") for one in kinds]
    mine = profile(*ports)
    assert {place.number for place in mine.placed(PortDirection.OUT)} == set(range(1, 513))
    indices = object_table(mine).objects
    assert {0x15FF, 0x17FF, 0x19FF, 0x1BFF, 0x2100, 0x24FF} <= indices.keys()


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
            {"ports": tuple(port(f"p{n}", SHORT, PortDirection.OUT) for n in range(513))},
            "513 out-ports with a PDO, there are 512",
        ),
        (
            {"ports": tuple(port(f"p{n}", STRING) for n in range(0x3F01))},
            "16129 ports, there are objects for 16128",
        ),
        ({"ports": (port("a", SHORT.sequence(255)),)}, "port a: 255 elements, an array has 254"),
        (
            {"ports": (special("a", STRING, transport=PortTransport.PDO),)},
            "port a: String, a PDO has 64 bits; take transport sdo",
        ),
        (
            {"ports": (special("a", SHORT.sequence(5), transport=PortTransport.PDO),)},
            "port a: 5 x Short are 80 bits, a PDO has 64 bits; take transport sdo",
        ),
        (
            {"ports": (special("a", STRING, cob_id=0x300),)},
            "port a: it has no PDO for cob_id 300h",
        ),
        ({"ports": (special("a", SHORT, cob_id=0x180),)}, "port a: cob_id 180h is not in 181h"),
        ({"ports": (special("a", SHORT, cob_id=0x581),)}, "port a: cob_id 581h is not in 181h"),
        (
            {"ports": tuple(special(name, SHORT, cob_id=0x222) for name in "ab")},
            "cob_id 222h belongs to 2 ports; give each its own",
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
