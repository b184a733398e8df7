"""Foreign Modbus masters at the emulated base: pymodbus and minimalmodbus."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import minimalmodbus
import pytest
from pymodbus.client import ModbusSerialClient

from tickrig.emulators.bench.child import running

pytestmark = pytest.mark.realtime


TIMEOUT_S = 5.0


@pytest.fixture
def tty() -> Iterator[str]:
    with running("tickrig.emulators.rh3.cli") as child:
        yield str(child.link)


def wait_until(done: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + TIMEOUT_S
    while not done():
        assert time.monotonic() < deadline_s


def test_pymodbus_drives_the_base(tty: str) -> None:
    with ModbusSerialClient(tty, baudrate=115_200, timeout=1) as master:
        assert master.read_holding_registers(0, count=2).registers == [0x5248, 0x0100]
        assert not master.write_register(0x10, 1).isError()
        assert not master.write_register(0x11, 1).isError()
        answer = master.readwrite_registers(
            read_address=0x200, read_count=12, write_address=0x100, values=[0, 9_000, 0, 9_000]
        )
        assert len(answer.registers) == 12
        wait_until(lambda: master.read_holding_registers(0x204, count=2).registers[1] > 100)
        refused = master.read_holding_registers(0x300, count=1)
        assert (refused.isError(), refused.exception_code) == (True, 2)


def test_minimalmodbus_drives_the_base(tty: str) -> None:
    master = minimalmodbus.Instrument(tty, 1)
    master.serial.baudrate = 115_200
    master.serial.timeout = 1
    assert master.read_registers(0, 2) == [0x5248, 0x0100]
    master.write_register(0x10, 1, functioncode=6)
    master.write_register(0x11, 1)
    master.write_long(0x100, -9_000, signed=True)
    wait_until(lambda: master.read_long(0x204, signed=True) < -100)
    with pytest.raises(minimalmodbus.IllegalRequestError):
        master.read_register(0x300)
