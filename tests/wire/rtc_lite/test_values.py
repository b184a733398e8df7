from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.rtc_lite.vectors import VECTORS, raw
from tickrig.wire.errors import FieldError, FramingError
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import LiteFrame
from tickrig.wire.rtc_lite.messages import (
    LiteComponentProfile,
    LitePortData,
    LitePortProfile,
    LiteReply,
    parse_component_profile,
    parse_port_data,
    parse_port_profile,
    parse_reply,
)
from tickrig.wire.rtc_lite.values import (
    CHAR,
    CHAR_SEQ,
    LONG,
    LONG_SEQ,
    PORT_TYPES,
    SHORT,
    LitePortType,
    encode_name,
)

ROWS = VECTORS["marshalling"]
floats = st.floats(width=32, allow_nan=False)
ELEMENTS: dict[str, st.SearchStrategy[Any]] = {
    "b": st.booleans(),
    "o": st.integers(0, 0xFF),
    "s": st.integers(-0x8000, 0x7FFF),
    "l": st.integers(-0x8000_0000, 0x7FFF_FFFF),
    "f": floats,
    "d": floats,
}


def value_of(row: dict[str, Any]) -> Any:
    return tuple(row["value"]) if isinstance(row["value"], list) else row["value"]


@pytest.mark.parametrize("row", ROWS, ids=[row["type"] for row in ROWS])
def test_a_golden_value_is_read_and_written_in_its_frame(row: dict[str, Any]) -> None:
    port_type, value = PORT_TYPES[row["type"]], value_of(row)
    assert port_type.encode(value) == raw(row["bytes"])
    assert port_type.decode(raw(row["bytes"])) == value
    data = LitePortData(b"in", port_type.encode(value)).encode()
    assert LiteFrame(LiteCommand.WRITE, data).encode() == raw(row["frame"])


def test_all_types_of_the_table_are_there() -> None:
    assert sorted(PORT_TYPES) == sorted(row["type"] for row in ROWS)


@pytest.mark.unmeasured
@given(st.data(), st.sampled_from(sorted(PORT_TYPES)))
def test_values_come_back(data: st.DataObject, code: str) -> None:
    port_type = PORT_TYPES[code]
    characters = st.characters(max_codepoint=0xFF)
    strategy: st.SearchStrategy[Any]
    if code in "cC":
        strategy = characters if code == "c" else st.text(characters, max_size=20)
    else:
        element = ELEMENTS[code.lower()]
        strategy = element if code.islower() else st.lists(element, max_size=9).map(tuple)
    value = data.draw(strategy)
    assert port_type.decode(port_type.encode(value)) == value


@pytest.mark.parametrize("port_type", PORT_TYPES.values(), ids=list(PORT_TYPES))
def test_the_initial_value_is_a_value(port_type: LitePortType[Any]) -> None:
    assert port_type.decode(port_type.encode(port_type.initial)) == port_type.initial


@given(st.binary(max_size=20), st.sampled_from(sorted(PORT_TYPES)))
def test_any_bytes_are_a_value_or_refused(data: bytes, code: str) -> None:
    port_type = PORT_TYPES[code]
    fits = len(data) % port_type.size == 0 if code.isupper() else len(data) == port_type.size
    if fits:
        port_type.decode(data)
    else:
        with pytest.raises(FieldError, match=port_type.name):
            port_type.decode(data)


@pytest.mark.parametrize(
    ("port_type", "value", "error"),
    [
        (SHORT, 40_000, "TimedShort cannot be \\(40000,\\)"),
        (LONG, "x", "TimedLong cannot be"),
        (LONG_SEQ, (1, 2**31), "TimedLongSeq cannot be"),
        (PORT_TYPES["f"], 1e300, "TimedFloat cannot be"),
        (CHAR, "no", "TimedChar of 2 bytes: it has 1 bytes"),
        (CHAR_SEQ, "€", "TimedCharSeq '€' has a character beyond Latin-1"),
    ],
)
def test_a_value_of_another_type_is_refused(
    port_type: LitePortType[Any], value: object, error: str
) -> None:
    with pytest.raises(FieldError, match=error):
        port_type.encode(value)


@pytest.mark.parametrize("name", ["in", "x" * 15, "a.b~!"])
def test_a_short_name_fits(name: str) -> None:
    assert encode_name(name).decode() == name


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("", "name '' has 0 characters, 1..15 fit"),
        ("x" * 16, "has 16 characters, 1..15 fit"),
        ("a b", "name 'a b' is not printable ASCII without blanks"),
        ("é", "is not printable ASCII"),
    ],
)
def test_another_name_is_refused(name: str, error: str) -> None:
    with pytest.raises(FieldError, match=error):
        encode_name(name)


def test_port_data_that_fill_a_frame_fit_and_no_more() -> None:
    assert len(LitePortData(b"in", bytes(56)).encode()) == 60
    with pytest.raises(FieldError, match="make 61 data bytes, 60 fit"):
        LitePortData(b"in", bytes(57))


@given(st.binary(max_size=15), st.binary(max_size=43))
def test_messages_come_back(name: bytes, data: bytes) -> None:
    sent = LitePortData(name, data)
    assert parse_port_data(sent.encode()) == sent
    port = LitePortProfile("l", name)
    assert parse_port_profile(port.encode()) == port
    component = LiteComponentProfile(2, 3, name)
    assert parse_component_profile(component.encode()) == component


def test_a_reply_has_a_status_and_what_it_lets_follow() -> None:
    assert parse_reply(LiteFrame(LiteCommand.EXECUTE, b"@A")) == LiteReply(0x40, b"A")
    assert parse_reply(LiteFrame(LiteCommand.EXECUTE, b"@A")).ok
    assert not parse_reply(LiteFrame(LiteCommand.WRITE, b"F")).ok
    assert LiteReply(0x40, b"A").encode() == b"@A"


@pytest.mark.parametrize("data", [b"", b"@", b"@AA", b"!A"])
def test_a_reply_of_another_length_is_refused(data: bytes) -> None:
    with pytest.raises(FramingError, match=r"AE.* is not a reply"):
        parse_reply(LiteFrame(LiteCommand.EXECUTE, data))


@given(st.binary(max_size=20))
def test_any_data_are_read_or_refused(data: bytes) -> None:
    for parse in (parse_port_data, parse_port_profile, parse_component_profile):
        with suppress(FramingError):
            assert parse(data).encode() == data
