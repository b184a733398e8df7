"""The boot loader of f-palette-boot: stop, clear, download, start (CiA 302-3)."""

from __future__ import annotations

from binascii import crc32
from copy import deepcopy

import pytest

from tests.device.canopen.objects import read, write
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.models.f_palette_boot import PROGRAM, make_f_palette_boot
from tickrig.device.canopen.parameter_store import FLASHING_US, FlashError, ProgramCommand
from tickrig.device.canopen.slave import TICK_US, Nonvolatile
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo_frame import AbortCode

DATA, CONTROL, IDENTIFICATION, STATUS = 0x1F50, 0x1F51, 0x1F56, 0x1F57
STOP, START, RESET, CLEAR = ProgramCommand
FLASHING = FLASHING_US // TICK_US
NEW = bytes(range(200))


def booted(memory: Nonvolatile | None = None) -> Bus:
    bus = Bus(make_f_palette_boot(5, memory))
    bus.step()
    return bus


def command(bus: Bus, value: int) -> AbortCode | None:
    return write(bus, CONTROL, value, 1)


def state(bus: Bus) -> tuple[Value, Value, Value]:
    """Return whether it runs, what identifies its program, and its flash status."""
    control, identification, status = (
        read(bus, index, 1) for index in (CONTROL, IDENTIFICATION, STATUS)
    )
    return control, identification, status


def flashed(bus: Bus) -> Bus:
    """Let the flash be written."""
    bus.run(FLASHING)
    return bus


def test_a_program_is_stopped_cleared_downloaded_and_started() -> None:
    bus = booted()
    assert state(bus) == (1, crc32(PROGRAM), 0)
    assert command(bus, STOP) is None
    assert bus.step() == ["705#00"]
    assert command(bus, CLEAR) is None
    assert state(bus) == (0, 0, 1 | FlashError.NO_PROGRAM << 1)
    flashed(bus)
    assert state(bus) == (0, 0, FlashError.NO_PROGRAM << 1)
    assert write(bus, DATA, NEW, 1) is None
    assert state(bus) == (0, crc32(NEW), 1)
    assert state(flashed(bus)) == (0, crc32(NEW), 0)
    assert command(bus, START) is None
    assert bus.step() == ["705#00"]
    assert state(bus) == (1, crc32(NEW), 0)


def test_while_it_is_stopped_there_are_the_objects_of_the_boot_loader_alone() -> None:
    bus = booted()
    assert bus.step("605#4000620100000000") == ["585#4F00620100000000"]
    assert bus.step("605#2F511F0100000000") == ["585#60511F0100000000", "705#00"]
    assert bus.step("605#4000620100000000") == ["585#8000620100000206"]
    assert bus.step("605#4018100200000000") == ["585#4318100202000000"]
    assert bus.step("605#40501F0900000000") == ["585#80501F0911000906"]
    assert bus.step("605#2F511F0101000000") == ["585#60511F0100000000", "705#00"]
    assert bus.step("605#4000620100000000") == ["585#4F00620100000000"]


def test_nmt_start_is_not_obeyed_while_it_is_stopped() -> None:
    bus = booted()
    command(bus, STOP)
    bus.step("000#0105")
    assert bus.slave.state.name == "PRE_OPERATIONAL"
    bus.step("000#8105")
    assert state(bus)[0] == STOP
    command(bus, START)
    bus.step("000#0105")
    assert bus.slave.state.name == "OPERATIONAL"


def test_a_reset_of_the_program_starts_it_anew() -> None:
    bus = booted()
    assert command(bus, RESET) is None
    assert bus.step() == ["705#00"]
    assert state(bus)[0] == START
    assert command(bus, START) is None, "it runs: nothing is to be done"
    assert bus.step() == []


def test_what_does_not_fit_the_state_is_refused() -> None:
    bus = booted()
    assert command(bus, 4) is AbortCode.VALUE_RANGE
    assert command(bus, CLEAR) is AbortCode.DEVICE_STATE
    assert write(bus, DATA, NEW, 1) is AbortCode.DEVICE_STATE
    command(bus, STOP)
    assert write(bus, DATA, NEW, 1) is AbortCode.DEVICE_STATE
    assert state(bus)[2] == FlashError.NOT_CLEARED << 1
    command(bus, CLEAR)
    assert command(bus, CLEAR) is AbortCode.DEVICE_STATE, "the flash is busy"
    assert write(bus, DATA, NEW, 1) is AbortCode.DEVICE_STATE
    assert command(flashed(bus), START) is AbortCode.DEVICE_STATE, "there is no program"
    assert command(bus, RESET) is AbortCode.DEVICE_STATE


@pytest.mark.parametrize("program", [b"", NEW])
def test_what_is_in_the_flash_outlasts_the_power(program: bytes) -> None:
    memory = Nonvolatile()
    bus = booted(memory)
    command(bus, STOP)
    command(bus, CLEAR)
    flashed(bus)
    write(bus, DATA, program, 1)
    again = booted(memory)
    assert state(again)[:2] == (bool(program), crc32(program))
    assert memory.version == 2


def test_stored_parameters_are_none_of_its_commands() -> None:
    bus = booted()
    write(bus, 0x1010, int.from_bytes(b"save", "little"), 1)
    assert not [key for key in bus.slave.nonvolatile.parameters if key >> 8 in (DATA, CONTROL)]


def test_a_twin_has_a_flash_of_its_own() -> None:
    bus = booted()
    command(bus, STOP)
    twin = deepcopy(bus.slave)
    command(bus, CLEAR)
    assert read(Bus(twin), IDENTIFICATION, 1) == crc32(PROGRAM)
