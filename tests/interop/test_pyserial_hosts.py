"""Hosts of others with pyserial, at devices in virtual time: `tickrig://`."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import minimalmodbus
import pytest
import serial
from pymodbus.client import ModbusSerialClient

from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside import protocol_tickrig
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.rs485_line import Rs485Line

URL = "tickrig://base"


@pytest.fixture
def rig() -> Iterator[Rig]:
    line = Rs485Line()
    rig = Rig(Station(Rh3Base(BaseParameters()), line.a))
    with SERIAL_PORTS.offer("base", SerialSide(rig, line.b)):
        yield rig


@pytest.fixture
def master(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> Iterator[minimalmodbus.Instrument]:
    """Return minimalmodbus, whose clock is the rig's: it waits between two frames."""
    clock = SimpleNamespace(
        monotonic=lambda: rig.now_us / 1e6, sleep=lambda for_s: rig.run_for(round(for_s * 1e6))
    )
    monkeypatch.setattr(minimalmodbus, "time", clock)
    monkeypatch.setattr(minimalmodbus, "_latest_read_times", {})
    with serial.serial_for_url(URL, 115_200, timeout=1) as port:
        yield minimalmodbus.Instrument(port, 1)


def test_minimalmodbus_drives_a_base_in_virtual_time(
    rig: Rig, master: minimalmodbus.Instrument
) -> None:
    assert master.read_registers(0, 2) == [0x5248, 0x0100]
    assert rig.now_us < 50_000
    master.write_register(0x10, 1, functioncode=6)
    master.write_register(0x11, 1)
    master.write_long(0x100, -9_000, signed=True)
    for _ in range(100):
        if master.read_long(0x204, signed=True) < -100:
            break
    else:
        pytest.fail("it does not move")
    with pytest.raises(minimalmodbus.IllegalRequestError):
        master.read_register(0x300)


def test_a_host_that_calls_serial_itself_gets_a_port_of_the_rig(
    rig: Rig, master: minimalmodbus.Instrument, monkeypatch: pytest.MonkeyPatch
) -> None:
    master.serial.close()
    monkeypatch.setattr(serial, "Serial", protocol_tickrig.Serial)
    own = minimalmodbus.Instrument(URL, 1)
    own.serial.baudrate = 115_200
    assert own.read_registers(0, 2) == [0x5248, 0x0100]


def test_minimalmodbus_waits_its_timeout_and_no_longer(
    rig: Rig, master: minimalmodbus.Instrument
) -> None:
    master.address = 7  # nobody's
    before_us = rig.now_us
    with pytest.raises(minimalmodbus.NoResponseError):
        master.read_register(0)
    assert 1_000_000 <= rig.now_us - before_us < 1_010_000


def test_minimalmodbus_hears_nothing_of_a_base_at_another_rate(
    rig: Rig, master: minimalmodbus.Instrument
) -> None:
    master.serial.baudrate = 19_200
    with pytest.raises((minimalmodbus.NoResponseError, minimalmodbus.InvalidResponseError)):
        master.read_register(0)
    master.serial.baudrate = 115_200
    rig.run_for(100_000)
    assert master.read_register(0) == 0x5248


def test_pymodbus_drives_a_base_in_virtual_time(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    from pymodbus.client import serial as client  # noqa: PLC0415 - the module with its clock

    monkeypatch.setattr(
        client,
        "time",
        SimpleNamespace(
            time=lambda: rig.now_us / 1e6, sleep=lambda for_s: rig.run_for(round(for_s * 1e6))
        ),
    )
    with ModbusSerialClient(URL, baudrate=115_200, timeout=1) as master:
        assert master.read_holding_registers(0, count=2).registers == [0x5248, 0x0100]
        assert not master.write_register(0x10, 1).isError()
