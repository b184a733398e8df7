"""Object tables become dictionaries that a slave can be made of."""

from __future__ import annotations

import pytest

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.communication_profile import (
    OFF,
    CommunicationProfile,
    Pdo,
    add_communication,
)
from tickrig.wire.canopen.eds.object_table import ROT, RWW, ObjectCode, ObjectTable

PROFILE = CommunicationProfile(
    device_type=0x0003_0191,
    name="lamp",
    hardware="A",
    software="1",
    product_code=7,
    rpdos=(Pdo(0x200, (0x6200_0108,)), Pdo(OFF | 0x300)),
    tpdos=(Pdo(0x180, (0x6000_0108,), inhibit_100us=100, event_ms=50),),
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
