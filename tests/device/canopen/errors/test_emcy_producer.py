from __future__ import annotations

import pytest

from tests.device.canopen.objects import array, booted, errors, make_bus, read, u8, u32, write
from tickrig.wire.can import ErrorState
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode


def test_an_error_is_told_once_and_again_when_it_is_gone() -> None:
    bus = booted(errors())
    bus.slave.emergency(0x5000, 0x20, b"why")
    assert bus.step() == ["085#0050217768790000"]
    bus.slave.emergency(0x5000, 0x20, b"why")
    assert bus.run(10) == []
    bus.slave.emergency_clear(0x5000)
    assert bus.step() == ["085#0000007768790000"]
    bus.slave.emergency_clear(0x5000)
    assert bus.run(10) == []


def test_a_text_is_cut_to_five_bytes() -> None:
    bus = booted(errors())
    bus.slave.emergency(0xFF00, 0x80, b"1234567")
    assert bus.step() == ["085#00FF813132333435"]
    bus.slave.emergency_clear(0xFF00, b"1234567")
    assert bus.step() == ["085#0000003132333435"]


def test_the_register_is_what_the_errors_that_are_left_say() -> None:
    bus = booted(errors())
    bus.slave.emergency(0x3100, 0x04)
    bus.slave.emergency(0x8130, 0x10, b"\7")
    assert bus.step() == ["085#0031050000000000", "085#3081150700000000"]
    assert read(bus, 0x1001) == 0x15
    bus.slave.emergency_clear(0x3100)
    assert bus.step() == ["085#0000110000000000"]
    bus.slave.emergency_clear(0x8130)
    assert bus.step() == ["085#0000000700000000"]
    assert read(bus, 0x1001) == 0


def test_errors_of_one_code_are_told_apart_by_their_text() -> None:
    bus = booted(errors())
    bus.slave.emergency(0x8130, 0x10, b"\7")
    bus.slave.emergency(0x8130, 0x10, b"\x08")
    assert len(bus.step()) == 2
    bus.slave.emergency_clear(0x8130, b"\7")
    assert bus.step() == ["085#0000110700000000"]
    bus.slave.emergency_clear(0x8130, b"\7")
    assert bus.step() == []
    bus.slave.emergency(0x8130, 0x10, b"\7")
    assert bus.step() == ["085#3081110700000000"]
    bus.slave.emergency_clear(0x8130)
    assert bus.step() == ["085#0000110800000000", "085#0000000700000000"]


def test_the_newest_error_is_at_the_top_of_the_history() -> None:
    bus = booted(errors())
    for code in (0x1000, 0x2000, 0x3000, 0x4000):
        bus.slave.emergency(code, 0, b"\x34\x12\x56")
    bus.slave.emergency_clear(0x4000)
    assert read(bus, 0x1003) == 3
    assert [read(bus, 0x1003, sub) for sub in (1, 2, 3)] == [0x12344000, 0x12343000, 0x12342000]


def test_an_empty_field_has_no_data() -> None:
    bus = booted(errors())
    assert read(bus, 0x1003, 1) == AbortCode.NO_DATA
    bus.slave.emergency(0x5000, 1)
    assert read(bus, 0x1003, 1) == 0x5000
    assert read(bus, 0x1003, 2) == AbortCode.NO_DATA


def test_zero_forgets_the_history_and_nothing_else_may_be_written() -> None:
    bus = booted(errors())
    bus.slave.emergency(0x5000, 1)
    assert write(bus, 0x1003, 1) == AbortCode.VALUE_RANGE
    assert read(bus, 0x1003) == 1
    assert write(bus, 0x1003, 0) is None
    assert read(bus, 0x1003) == 0
    assert read(bus, 0x1003, 1) == AbortCode.NO_DATA


def test_the_inhibit_time_holds_back_the_second_emcy() -> None:
    bus = booted(errors())
    write(bus, 0x1015, 1000)
    bus.slave.emergency(0x5000, 1)
    bus.slave.emergency(0x3100, 1)
    assert bus.step() == ["085#0050010000000000"]
    assert bus.run(99) == []
    assert bus.step() == ["085#0031010000000000"]
    bus.run(50)
    bus.slave.emergency_clear(0x3100)
    assert bus.run(49) == []
    assert bus.step() == ["085#0000010000000000"]


def test_a_flood_of_errors_is_cut() -> None:
    bus = booted(errors())
    for number in range(100):
        bus.slave.emergency(0xFF00, 0x80, bytes([number]))
    assert len(bus.step()) == 16
    assert read(bus, 0x1003) == 3


def test_an_emcy_waits_in_stopped() -> None:
    bus = booted(errors())
    bus.step("000#0205")
    bus.slave.emergency(0x5000, 1)
    assert bus.run(100) == []
    assert read(bus, 0x1001) == 1
    assert bus.step("000#8005") == ["085#0050010000000000"]


def test_an_emcy_waits_until_bus_off_is_over() -> None:
    bus = booted(errors())
    bus.slave.bus_state(ErrorState.BUS_OFF)
    bus.slave.emergency(0x5000, 1)
    assert bus.run(10) == []
    bus.slave.bus_state(ErrorState.ACTIVE)
    assert bus.step()[0] == "085#0050010000000000"


def test_a_reset_forgets_errors_and_messages() -> None:
    bus = booted(errors())
    bus.slave.emergency(0x5000, 1)
    assert bus.step("000#8205") == ["705#00"]
    assert bus.run(10) == []
    assert read(bus, 0x1001) == read(bus, 0x1003) == 0
    bus.slave.emergency(0x5000, 1)
    assert bus.step() == ["085#0050010000000000"]


def test_bit_31_silences_it_but_register_and_history_go_on() -> None:
    bus = booted(errors())
    assert write(bus, 0x1014, 0x8000_0085) is None
    bus.slave.emergency(0x5000, 1)
    assert bus.run(10) == []
    assert read(bus, 0x1003, 1) == 0x5000
    assert read(bus, 0x1001) == 1
    assert write(bus, 0x1014, 0xC5) is None
    assert bus.run(10) == []
    bus.slave.emergency_clear(0x5000)
    assert bus.step() == ["0C5#0000000000000000"]


@pytest.mark.parametrize(
    ("cob_id", "refused"),
    [
        (0x85, None),
        (0x8000_0085, None),
        (0x8000_0000, None),
        (0xC5, AbortCode.VALUE_RANGE),  # another CAN-ID while it is valid
        (0x4000_0085, AbortCode.VALUE_RANGE),  # a reserved bit
        (0x2000_0085, AbortCode.VALUE_RANGE),  # 29-bit
        (0x0000_0885, AbortCode.VALUE_RANGE),  # more than 11 bits
    ],
)
def test_the_can_id_stays_while_it_is_in_use(cob_id: int, refused: AbortCode | None) -> None:
    assert write(booted(errors()), 0x1014, cob_id) is refused


@pytest.mark.parametrize("can_id", [0x000, 0x07F, 0x601, 0x705, 0x7E5])
def test_a_restricted_can_id_is_refused(can_id: int) -> None:
    bus = booted(errors())
    assert write(bus, 0x1014, 0x8000_0000) is None
    assert write(bus, 0x1014, can_id) is AbortCode.VALUE_RANGE


def test_a_cob_id_that_is_no_number_is_refused() -> None:
    bus = booted(
        [EntryDescription(0x1014, 0, "odd", DataType.VISIBLE_STRING, Access.READ | Access.WRITE)]
    )
    assert write(bus, 0x1014, "abc") is AbortCode.VALUE_RANGE


def test_without_objects_nothing_is_sent_and_nothing_breaks() -> None:
    bus = booted(array(0x1003, 0)[1:])
    bus.slave.emergency(0x5000, 1)
    bus.slave.emergency_clear(0x5000)
    assert bus.run(10) == []


def test_with_the_cob_id_alone_emcys_are_sent() -> None:
    bus = booted(u32(0x1014, 0x85))
    bus.slave.emergency(0x5000, 1)
    assert bus.step() == ["085#0050010000000000"]


def test_a_slave_without_power_has_no_errors() -> None:
    bus = make_bus(errors())
    bus.slave.emergency(0x5000, 1)
    bus.slave.bus_state(ErrorState.PASSIVE)
    bus.slave.emergency_clear(0x5000)
    assert bus.run(5) == ["705#00"]


def test_a_lost_frame_is_told_and_is_over() -> None:
    bus = booted(errors())
    bus.slave.overrun()
    assert bus.step() == ["085#1081110000000000", "085#0000000000000000"]


def test_a_history_without_fields_is_left_alone() -> None:
    bus = booted(u8(0x1003))
    bus.slave.emergency(0x5000, 1)
    assert read(bus, 0x1003) == 0
