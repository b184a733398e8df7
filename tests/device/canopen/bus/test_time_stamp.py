from __future__ import annotations

import pytest

from tests.device.canopen.objects import booted, u32, write
from tickrig.device.canopen.sync import TimeStamp
from tickrig.wire.canopen.datatypes import TimeOfDay
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.errors import FieldError

CONSUMER = 0x8000_0100
PRODUCER = 0x4000_0100
AT = TimeOfDay(69_838_000, 17_201)


def test_time_is_heard_if_bit_31_says_so() -> None:
    bus = booted(u32(0x1012, 0x100))
    bus.step("100#B0A429043143")
    assert bus.slave.time_of_day is None
    assert write(bus, 0x1012, CONSUMER) is None
    bus.step("100#B0A429043143")
    assert bus.slave.time_of_day == AT


def test_the_clock_goes_on_from_the_time_stamp() -> None:
    bus = booted(u32(0x1012, CONSUMER))
    clock = TimeStamp.of(bus.slave)
    bus.step("100#B0A429043143")
    bus.run(250)
    assert clock.now == TimeOfDay(69_838_250, 17_201)
    assert bus.slave.time_of_day == AT


def test_there_is_no_time_of_day_before_the_first_time_stamp() -> None:
    assert TimeStamp.of(booted(u32(0x1012, CONSUMER)).slave).now is None


@pytest.mark.parametrize("frame", ["100#", "100#B0A42904314300", "100#005C26050000", "101#00"])
def test_what_is_no_time_is_ignored(frame: str) -> None:
    bus = booted(u32(0x1012, CONSUMER))
    bus.step(frame)
    assert bus.slave.time_of_day is None


def test_time_is_not_heard_in_stopped() -> None:
    bus = booted(u32(0x1012, CONSUMER))
    bus.step("000#0205", "100#B0A429043143")
    assert bus.slave.time_of_day is None


def test_power_off_forgets_the_time_but_a_reset_does_not() -> None:
    bus = booted(u32(0x1012, CONSUMER))
    bus.step("100#B0A429043143")
    bus.step("000#8105")
    assert bus.slave.time_of_day == AT
    bus.slave.reset()
    bus.step()
    assert bus.slave.time_of_day is None


def test_the_application_produces_time_if_bit_30_says_so() -> None:
    bus = booted(u32(0x1012, PRODUCER))
    TimeStamp.of(bus.slave).produce(AT)
    assert bus.step() == ["100#B0A429043143"]
    assert bus.slave.time_of_day == AT
    assert bus.run(10) == []


@pytest.mark.parametrize("objects", [[], u32(0x1012, 0x100)])
def test_who_is_no_producer_sends_no_time(objects: list[EntryDescription]) -> None:
    bus = booted(objects)
    TimeStamp.of(bus.slave).produce(AT)
    assert bus.step() == []
    assert bus.slave.time_of_day == AT


def test_no_time_is_sent_in_stopped() -> None:
    bus = booted(u32(0x1012, PRODUCER))
    bus.step("000#0205")
    TimeStamp.of(bus.slave).produce(AT)
    assert bus.step() == []


def test_an_impossible_time_is_not_produced() -> None:
    with pytest.raises(FieldError, match="a day has"):
        TimeStamp.of(booted().slave).produce(TimeOfDay(86_400_000, 0))


@pytest.mark.parametrize(
    ("cob_id", "refused"),
    [
        (0x8000_0601, AbortCode.VALUE_RANGE),
        (0xA000_0100, AbortCode.VALUE_RANGE),
        (0x8000_00B0, AbortCode.VALUE_RANGE),
        (0x0000_00B0, None),
        (0xC000_0100, None),
    ],
)
def test_the_can_id_stays_while_it_is_in_use(cob_id: int, refused: AbortCode | None) -> None:
    assert write(booted(u32(0x1012, CONSUMER)), 0x1012, cob_id) is refused
