from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort
from tickrig.device.physical import SignalType
from tickrig.emulators.canopen.signals import ObjectSignal, find_object, object_name
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import (
    Access,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)
from tickrig.wire.canopen.sdo_frame import AbortCode

RO, RW, CONST = Access.READ, Access.READ | Access.WRITE, Access.READ | Access.CONST
D = DataType


def dictionary() -> Dictionary:
    entries = [
        EntryDescription(0x1000, 0, "device type", D.UNSIGNED32, CONST, default=0x191),
        EntryDescription(0x1017, 0, "heartbeat", D.UNSIGNED16, RW),
        EntryDescription(0x2006, 0, "limited", D.INTEGER16, RO, low=-5, high=5),
        EntryDescription(0x2007, 0, "text", D.VISIBLE_STRING, Access.WRITE, max_bytes=4),
        EntryDescription(0x2008, 0, "blob", D.DOMAIN, Access.NONE),
        EntryDescription(0x200A, 0, "real", D.REAL32, RW),
        EntryDescription(0x6000, 0, "count", D.UNSIGNED8, CONST, default=1),
        EntryDescription(0x6000, 1, "input", D.UNSIGNED8, RO),
    ]
    return Dictionary(entries, {0x6000: ObjectDescription("inputs", ObjectCode.ARRAY)})


def signal(name: str, objects: Dictionary | None = None) -> tuple[ObjectSignal, Entry]:
    objects = objects or dictionary()
    entry = find_object(objects, name)
    assert entry is not None

    def at_once(act: Callable[[], None]) -> None:
        act()

    return ObjectSignal(object_name(objects, entry), entry, at_once), entry


@pytest.mark.parametrize(
    ("name", "canonical"),
    [
        ("0x1017", "0x1017"),
        ("0x1017:0", "0x1017"),
        ("0x6000:1", "0x6000:1"),
        ("0x6000:0x1", "0x6000:1"),
        ("0x6000", "0x6000:0"),
        ("0x200a", "0x200A"),
    ],
)
def test_an_object_is_named_by_index_and_sub_index(name: str, canonical: str) -> None:
    assert signal(name)[0].item.name == canonical


@pytest.mark.parametrize("name", ["0x5000", "0x6000:2", "6000:1", "0x600", "0x6000:999", "", "x"])
def test_what_is_no_object_is_not_found(name: str) -> None:
    assert find_object(dictionary(), name) is None


def test_an_object_tells_what_it_is() -> None:
    item = signal("0x2006")[0].item
    assert (item.text, item.type, item.low, item.high, item.unit) == (
        *("limited (ro)", SignalType.LEVEL, -5, 5),
        "INTEGER16",
    )
    item = signal("0x2007")[0].item
    assert (item.text, item.type, item.unit) == ("text (wo)", SignalType.TEXT, "VISIBLE_STRING")
    assert signal("0x2008")[0].item.text == "blob (hidden)"
    assert signal("0x1000")[0].item.text == "device type (const)"
    assert (signal("0x1017")[0].item.low, signal("0x1017")[0].item.high) == (0, 0xFFFF)


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [
        ("0x1017", 1_000, 1_000),
        ("0x2006", -5, -5),
        ("0x2007", "abcd", "abcd"),
        ("0x2007", 42, "42"),
        ("0x2008", "hex:01ff", "hex:01ff"),
        ("0x2008", "hex:", "hex:"),
        ("0x200A", 1.5, 1.5),
        ("0x200A", 2, 2.0),
        ("0x6000:1", 255, 255),
    ],
)
def test_it_is_set_whatever_the_bus_may_do(name: str, value: Any, shown: Any) -> None:
    hand, _ = signal(name)
    hand.write(hand.check(value))
    assert hand.read() == shown


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("0x1000", 1, "0x1000 is constant"),
        ("0x1017", 65_536, "0x1017 65536 is not in 0..65535"),
        ("0x1017", "ten", "0x1017 'ten': 'ten' is no UNSIGNED16"),
        ("0x1017", 1.5, "0x1017 1.5: 1.5 is no UNSIGNED16"),
        ("0x2006", 6, "0x2006 6 is not in -5..5"),
        ("0x2007", "abcde", "0x2007 holds 4 bytes, not 5"),
        ("0x2008", "0102", "DOMAIN takes bytes, as hex:01ff"),
        ("0x2008", "hex:1", "DOMAIN takes bytes, as hex:01ff"),
        ("0x2008", 5, "DOMAIN takes bytes, as hex:01ff"),
        ("0x200A", "x", "0x200A 'x': 'x' is no REAL32"),
        ("0x200A", 1e39, "0x200A 1e\\+39 is not in"),
    ],
)
def test_what_it_cannot_be_is_refused(name: str, value: Any, error: str) -> None:
    hand, entry = signal(name)
    before = entry.data
    with pytest.raises(ValueError, match=error):
        hand.write(value)
    assert entry.data == before


def test_the_owner_of_an_object_judges_and_acts() -> None:
    hand, entry = signal("0x1017")
    acted: list[int] = []

    def guard(entry: Entry, value: object) -> None:
        if value == 7:
            raise SdoAbort(AbortCode.VALUE_RANGE)

    entry.guard, entry.written = guard, lambda entry: acted.append(entry.number)
    with pytest.raises(ValueError, match="0x1017 7: refused, VALUE_RANGE"):
        hand.write(7)
    hand.write(8)
    assert acted == [8]


def test_a_value_that_is_made_on_demand_is_made() -> None:
    hand, entry = signal("0x1017")
    entry.source = lambda entry: b"\x34\x12"
    assert hand.read() == 0x1234
    entry.source = lambda entry: b"\x34"
    assert hand.read() == "(1 bytes for UNSIGNED16, which has 2)"
