"""PDOs as ports: table 4, the 400h rule, data through the PC and past it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc import InPort, connect
from tickrig.host.rtc.canopen.pdo_layout import PDO_FIELD_TYPES, lay_out, proxy_index
from tickrig.host.rtc.canopen.proxy import PdoSink, PdoSource
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.pdo import MappedObject
from tickrig.wire.rtc_types import rtc
from tickrig.wire.rtc_types.rtc import Time, TimedLongLong, TimedShortSeq, TimedULongLong

GOLDEN = Path(__file__).parents[4] / "golden" / "rtc_canopen.json"
Row = tuple[int, type[Any], type[Any] | None, int, bytes, Any]
TABLE_4: list[Row] = [
    (DataType.BOOLEAN, rtc.TimedBoolean, rtc.TimedBooleanSeq, 8, b"\x01", True),
    (DataType.BOOLEAN, rtc.TimedBoolean, rtc.TimedBooleanSeq, 1, b"\x01", True),
    (DataType.VISIBLE_CHAR, rtc.TimedChar, rtc.TimedCharSeq, 8, b"A", "A"),
    (DataType.UNICODE_STRING, rtc.TimedWChar, rtc.TimedWCharSeq, 16, b"\x2b\x73", "猫"),
    (DataType.UNSIGNED8, rtc.TimedOctet, rtc.TimedOctetSeq, 8, b"\xfe", 254),
    (DataType.DOMAIN, rtc.TimedChar, rtc.TimedCharSeq, 8, b"A", "A"),
    (DataType.INTEGER8, rtc.TimedShort, rtc.TimedShortSeq, 8, b"\xfe", -2),
    (DataType.INTEGER16, rtc.TimedShort, rtc.TimedShortSeq, 16, b"\xfe\xff", -2),
    (DataType.UNSIGNED16, rtc.TimedUShort, rtc.TimedUShortSeq, 16, b"\xfe\xff", 65534),
    (DataType.REAL32, rtc.TimedFloat, rtc.TimedFloatSeq, 32, b"\0\0\x20\xc0", -2.5),
    (DataType.INTEGER32, rtc.TimedLong, rtc.TimedLongSeq, 32, b"\xfe\xff\xff\xff", -2),
    (DataType.UNSIGNED32, rtc.TimedULong, rtc.TimedULongSeq, 32, b"\1\0\0\x80", 0x8000_0001),
    (DataType.REAL64, rtc.TimedDouble, None, 64, bytes(6) + b"\x04\xc0", -2.5),
    (DataType.UNSIGNED64, TimedULongLong, None, 64, b"\1" + bytes(6) + b"\x80", (1 << 63) + 1),
    (DataType.INTEGER64, TimedLongLong, None, 64, b"\xfe" + b"\xff" * 7, -2),
]


def test_the_index_rule_is_that_of_the_figure() -> None:
    for pair in json.loads(GOLDEN.read_text("utf-8"))["pdo_pairs"]:
        device = pair.get("device_tpdo") or pair["device_rpdo"]
        proxy = pair.get("proxy_rpdo") or pair["proxy_tpdo"]
        maps = [int(word[:-1], 16) for word in pair["map"].split(" -> ")]
        assert proxy_index(int(device[:-1], 16)) == int(proxy[:-1], 16)
        assert proxy_index(maps[0]) == maps[1]


@pytest.mark.parametrize("row", TABLE_4)
def test_an_object_is_a_port_of_its_type(row: Row) -> None:
    code, one, many, bits, data, value = row
    layout = lay_out(0x1800, 0x181, (MappedObject(0x2100, 0, bits),), {(0x2100, 0): code})
    (port,) = PdoSource(layout, "x").ports
    assert (port.name, port.data_type) == ("x", one)
    assert layout.decode(data) == (value,)
    assert PdoSink(layout, "x").encode("x", one(Time(), value)) == data
    assert PDO_FIELD_TYPES[code, bits].many is many


@pytest.mark.parametrize(
    ("code", "bits", "value"),
    [
        (DataType.INTEGER16, 16, 32768),
        (DataType.UNSIGNED8, 8, -1),
        (DataType.UNSIGNED8, 8, "a"),
        (DataType.REAL32, 32, 1e39),
        (DataType.REAL32, 32, "a"),
        (DataType.DOMAIN, 8, "ab"),
        (DataType.DOMAIN, 8, "\u3042"),
        (DataType.DOMAIN, 8, 1),
    ],
)
def test_a_value_that_does_not_fit_is_refused(code: int, bits: int, value: Any) -> None:
    with pytest.raises(ValueError, match="is"):
        PDO_FIELD_TYPES[code, bits].encode(value)


def types(*codes: int) -> dict[tuple[int, int], int]:
    return {(0x2100, sub): code for sub, code in enumerate(codes)}


def mapped(*bits: int) -> tuple[MappedObject, ...]:
    return tuple(MappedObject(0x2100, sub, count) for sub, count in enumerate(bits))


def test_objects_of_one_type_are_a_sequence_in_the_order_of_the_mapping() -> None:
    layout = lay_out(0x1801, 0x290, mapped(16, 16), types(3, 3))
    (port,) = PdoSource(layout, "ai").ports
    assert port.data_type is TimedShortSeq
    assert layout.decode(bytes.fromhex("0100FFFF")) == (1, -1)


def test_octets_are_a_sequence_of_bytes() -> None:
    layout = lay_out(0x1400, 0x210, mapped(8, 8), types(5, 5))
    sink = PdoSink(layout, "do")
    assert sink.encode("do", rtc.TimedOctetSeq(Time(), b"\1\2")) == b"\1\2"
    source, in_ = PdoSource(layout, "di"), InPort("in", rtc.TimedOctetSeq)
    connect(source.ports[0], in_)
    source.receive(1_000, b"\1\2")
    assert in_.read() == rtc.TimedOctetSeq(Time(0, 1_000_000), b"\1\2")


def test_objects_of_several_types_have_ports_of_their_own() -> None:
    layout = lay_out(0x1400, 0x201, mapped(16, 32), types(6, 4))
    sink = PdoSink(layout, "rpdo1")
    assert [port.name for port in sink.ports] == ["rpdo1_2100_00", "rpdo1_2100_01"]
    sink.preset(0x2100, 0x0F)
    assert sink.encode("rpdo1_2100_01", rtc.TimedLong(Time(), -1)).hex() == "0f00ffffffff"
    assert sink.encode("rpdo1_2100_00", rtc.TimedUShort(Time(), 7)).hex() == "0700ffffffff"


def test_bits_and_dummies_keep_their_places() -> None:
    kinds = {(0x2100, 0): 1, (0x0005, 0): 5, (0x2100, 1): 1}
    entries = (MappedObject(0x2100, 0, 1), MappedObject(5, 0, 8), MappedObject(0x2100, 1, 1))
    layout = lay_out(0x1800, 0x181, entries, kinds)
    assert (layout.bits, layout.size, layout.unknown) == (10, 2, ())
    assert layout.decode(bytes.fromhex("0102")) == (True, True)
    assert layout.encode((False, True)).hex() == "0002"


@given(st.lists(st.sampled_from(sorted(PDO_FIELD_TYPES)), min_size=1, max_size=8), st.binary())
def test_what_is_decoded_is_encoded_again(kinds: list[tuple[int, int]], data: bytes) -> None:
    layout = lay_out(0x1800, 0x181, mapped(*(b for _, b in kinds)), types(*(c for c, _ in kinds)))
    size = layout.size
    data = data[:size].ljust(size, b"\0")
    values = layout.decode(data)
    if not any(value != value for value in values):  # noqa: PLR0124 - not a number
        assert layout.decode(layout.encode(values)) == values
