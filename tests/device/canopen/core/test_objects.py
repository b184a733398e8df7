"""Object tables become dictionaries that a slave can be made of."""

from __future__ import annotations

import pytest

from tests.device.canopen.objects import array, booted, errors, read, u8, u16, u32, write
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import (
    OFF,
    ROT,
    RW,
    RWW,
    CommunicationProfile,
    EntryDescription,
    ObjectCode,
    ObjectTable,
    add_communication,
)
from tickrig.wire.canopen.pdo import PdoDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

PROFILE = CommunicationProfile(
    device_type=0x0003_0191,
    name="lamp",
    hardware="A",
    software="1",
    product_code=7,
    rpdos=(PdoDescription(0x200, (0x6200_0108,)), PdoDescription(OFF | 0x300)),
    tpdos=(PdoDescription(0x180, (0x6000_0108,), inhibit_100us=100, event_ms=50),),
)


def lamp() -> Dictionary:
    objects = ObjectTable()
    add_communication(objects, PROFILE)
    objects.array(0x6000, "Read input 8-bit", 1, DataType.UNSIGNED8, ROT)
    objects.array(0x6200, "Write output 8-bit", 1, DataType.UNSIGNED8, RWW)
    return Dictionary(objects, objects.objects)


def test_the_device_says_who_it_is() -> None:
    bus = Bus(make_slave(lamp(), 5))
    bus.run(2)
    assert bus.step("605#4000100000000000") == ["585#4300100091010300"]
    assert bus.step("605#4018100200000000") == ["585#4318100207000000"]


def test_its_pdos_work_at_once() -> None:
    bus = Bus(make_slave(lamp(), 5))
    bus.run(2)
    bus.step("000#0105")
    bus.step("205#5A")
    assert bus.slave.dictionary[0x6200, 1].number == 0x5A


@pytest.mark.parametrize(
    ("at", "value"),
    [((0x1401, 1), OFF | 0x305), ((0x1800, 3), 100), ((0x1800, 5), 50), ((0x1A00, 0), 1)],
)
def test_pdo_parameters_are_those_of_the_table(at: tuple[int, int], value: int) -> None:
    slave = make_slave(lamp(), 5)
    slave.tick(0, ())
    assert slave.dictionary[at].number == value


def test_arrays_and_records_say_what_they_are() -> None:
    infos = lamp().objects
    assert infos[0x6000].code is ObjectCode.ARRAY
    assert infos[0x1018].code is ObjectCode.RECORD
    assert infos[0x1000].code is ObjectCode.VAR


I8, I16 = DataType.INTEGER8, DataType.INTEGER16


def pinned() -> list[EntryDescription]:
    """Give objects with rules of their own, whose limits leave them nothing but their default."""
    rows = [
        *(*errors(), *u32(0x1005, 0x80), *u8(0x1019), *u32(0x1012, 0x100), *u16(0x1006)),
        *(
            *array(0x1016, 0x0007_0064, 0),
            *array(0x1028, 0x87),
            *array(0x1029, 0, kind=DataType.UNSIGNED8),
        ),
        *(*array(0x1010, 1), *array(0x1011, 1)),
        *(EntryDescription(0x1400, 0, "n", DataType.UNSIGNED8, RW, default=6),),
        *array(0x1400, 0x205)[1:],
        *(
            EntryDescription(0x1400, sub, "x", kind, RW, default=0)
            for sub, kind in ((2, DataType.UNSIGNED8), (3, DataType.UNSIGNED16))
        ),
        *(*u8(0x1600), *array(0x1600, 0)[1:]),
        *array(0x1201, 0x8000_0000, 0x8000_0000),
        *(EntryDescription(0x6060, 0, "mode", I8, RW, default=0),),
        *(
            EntryDescription(index, 0, "option", I16, RW, default=1)
            for index in (0x6007, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E)
        ),
        *(EntryDescription(0x6086, 0, "profile", I16, RW, default=0),),
        *(EntryDescription(0x6098, 0, "homing", I8, RW, default=0),),
    ]
    return [
        EntryDescription(
            *(row.index, row.sub, row.name, row.data_type, row.access),
            default=row.default,
            relative=row.relative,
            low=(number := int.from_bytes(row.default, "little", signed=row.signed)),
            high=number,
        )
        for row in rows
    ]


@pytest.mark.parametrize(
    ("index", "sub", "value", "code"),
    [
        (0x1003, 0, 1, AbortCode.VALUE_RANGE),
        (0x1005, 0, 0x2000_0000, AbortCode.VALUE_RANGE),
        (0x1012, 0, 0x2000_0000, AbortCode.VALUE_RANGE),
        (0x1014, 0, 0x2000_0000, AbortCode.VALUE_RANGE),
        (0x1016, 2, 0x0007_0064, AbortCode.PARAMETER_INCOMPATIBLE),
        (0x1019, 0, 241, AbortCode.VALUE_RANGE),
        (0x1028, 1, 0x2000_0000, AbortCode.VALUE_RANGE),
        (0x1029, 1, 9, AbortCode.VALUE_RANGE),
        (0x1010, 1, 5, AbortCode.NOT_STORED),
        (0x1011, 1, 5, AbortCode.NOT_STORED),
        (0x1201, 1, 0x2000_0000, AbortCode.VALUE_RANGE),
        (0x1400, 1, 0x2000_0000, AbortCode.VALUE_RANGE),
        (0x1400, 2, 241, AbortCode.VALUE_RANGE),
        (0x1400, 3, 1, AbortCode.VALUE_RANGE),
        (0x1600, 0, 1, AbortCode.UNSUPPORTED_ACCESS),
        (0x1600, 1, 5, AbortCode.UNSUPPORTED_ACCESS),
        (0x6060, 0, 2, AbortCode.VALUE_RANGE),
        *((index, 0, 9, AbortCode.VALUE_RANGE) for index in range(0x605A, 0x605F)),
        (0x6007, 0, 9, AbortCode.VALUE_RANGE),
        (0x6086, 0, 9, AbortCode.VALUE_RANGE),
        (0x6098, 0, 36, AbortCode.VALUE_RANGE),
        (0x6060, 0, 1, AbortCode.VALUE_TOO_HIGH),
        (0x605A, 0, 0, AbortCode.VALUE_TOO_LOW),
        (0x1006, 0, 1, AbortCode.VALUE_TOO_HIGH),
    ],
)
def test_the_rule_of_an_object_comes_before_its_limits(
    index: int, sub: int, value: int, code: AbortCode
) -> None:
    bus = Bus(make_slave(Dictionary(pinned()), 5, application=Ds402))
    bus.step()
    assert write(bus, index, value, sub) is code


@pytest.mark.parametrize(("index", "word"), [(0x1010, b"save"), (0x1011, b"load")])
def test_the_limits_of_what_is_read_do_not_bound_a_command(index: int, word: bytes) -> None:
    bus = Bus(make_slave(Dictionary(pinned()), 5, application=Ds402))
    bus.step()
    assert write(bus, index, int.from_bytes(word, "little"), 1) is None


@pytest.mark.parametrize("value", [0, 1, 2, 3])
def test_a_store_reads_what_its_device_says_of_it(value: int) -> None:
    bus = booted(array(0x1010, value), array(0x1011, value), u8(0x2000))
    bus.slave.dictionary[0x2000, 0].assign(b"\5")
    assert read(bus, 0x1010, 1) == read(bus, 0x1011, 1) == value
    assert write(bus, 0x1010, int.from_bytes(b"save", "little"), 1) is None
    assert (read(bus, 0x1010, 1), bus.slave.nonvolatile.parameters) == (value, {0x200000: b"\5"})
