"""A device that changes its line: a host that follows understands it, another one does not."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from tests.emulators.changing import Changing
from tests.emulators.serial.outside.lines import BAUD, SETTING, rig_of
from tests.test_docs import blocks
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside.serial_side import SerialSide, UartErrors
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.wire.uart import UartSetting, sample

SLOW = UartSetting(9_600, 8, "E", 1)


def changing(**options: Any) -> SimSerial:
    line = SerialLine(BAUD)
    rig = Rig(Station(Changing(), line.a))
    return SimSerial(SerialSide(rig, line.b, SETTING), **{"timeout": 0.1, **options})


def told_to_change(**options: Any) -> SimSerial:
    port = changing(**options)
    port.write(b"=9600 8E1\n")
    assert port.readline() == b"OK\n"  # the answer has the old setting
    return port


def follow(port: SimSerial) -> None:
    port.baudrate, port.parity = 9_600, "E"


def test_a_host_that_follows_understands_the_device() -> None:
    port = told_to_change()
    follow(port)
    port.write(b"hello\n")
    assert port.readline() == b"hello\n"
    assert port.side is not None
    assert port.side.receiver.errors.framing == port.side.receiver.errors.parity == 0


def test_the_new_setting_takes_its_own_time_for_a_byte() -> None:
    port = told_to_change()
    follow(port)
    began_us = rig_of(port).now_us
    port.write(b"0123456789\n")
    assert port.readline() == b"0123456789\n"
    # 11 bytes of 11 bits each way at 9600 bit/s, and up to a tick of the device
    assert 2 * 12_604 <= rig_of(port).now_us - began_us <= 2 * 12_604 + 1_001


def test_a_host_that_does_not_follow_is_not_understood() -> None:
    port = told_to_change()
    port.write(b"hello\n")
    assert port.read(100) == b""  # whatever the device made of it was no line
    assert port.side is not None
    assert port.side.transmitter.errors != UartErrors()


def test_a_host_that_does_not_follow_reads_what_its_uart_samples() -> None:
    line = SerialLine(BAUD)
    rig = Rig(Station(Changing(), line.a))
    port = SimSerial(SerialSide(rig, line.b, SETTING), timeout=0.1)
    port.write(b"=9600 8E1\n")
    assert port.readline() == b"OK\n"
    line.a.send(rig.now_us, b"hello")
    wanted = sample(b"hello", SLOW, SETTING)
    assert port.read(100) == bytes(each.value for each in wanted)
    assert port.side is not None
    assert port.side.receiver.errors.framing == sum(
        each.framing_error and not each.line_break for each in wanted
    )


def test_bytes_on_their_way_when_it_changes_are_lost_or_garbled() -> None:
    port = changing()
    port.write(b"=9600 8E1\n" + b"x" * 30 + b"\n")
    assert port.readline() == b"OK\n"  # 300 us; by then some of the x are there, none is a line
    follow(port)
    port.write(b"\nhello\n")
    assert port.read(100).endswith(b"hello\n")
    assert b"x" * 30 not in port.read(100)


def told_in(bench: Bench) -> list[str]:
    """Return what the transcript says of settings, without times and the name of the line."""
    lines = (line.split(" ", 2)[2] for line in bench.transcript().splitlines())
    return [line for line in lines if "is set to" in line]


def test_a_host_that_does_not_follow_is_told_of_in_the_transcript() -> None:
    with Bench(Changing(115_200)) as bench:
        port = bench.serial(timeout=0.1)
        port.write(b"=9600 8E1\n")
        assert port.readline() == b"OK\n"
        assert told_in(bench) == []
        for _ in range(2):
            port.write(b"name\n")
            port.read(10)
        told = "~ the host is set to 115200 8N1, the device to 9600 8E1"
        assert told_in(bench) == [told]
        port.baudrate, port.parity = 9_600, "E"
        port.write(b"\nname\n")
        assert port.read_until(b"name\n").endswith(b"name\n")
        assert told_in(bench) == [told]


def test_a_host_that_only_listens_at_another_setting_is_told_of() -> None:
    with Bench(Changing(115_200)) as bench:
        port = bench.serial(timeout=0.1, baudrate=57_600)
        bench.link.send(b"name\n")
        port.read(5)
        assert told_in(bench) == ["~ the host is set to 57600 8N1, the device to 115200 8N1"]


def test_the_example_of_the_page_runs() -> None:
    (program,) = blocks("docs/reference/bench/serial-port.md", "python")
    exec(compile(program, "serial-port.md", "exec"), {})


def test_it_has_its_first_setting_again_after_a_power_cut() -> None:
    with Bench(Changing(115_200)) as bench:
        port = bench.serial(timeout=0.1)
        port.write(b"=9600 8E1\n")
        assert port.readline() == b"OK\n"
        bench.fault("no_power")
        bench.run_for("5ms")
        bench.clear("no_power")
        bench.run_for("5ms")
        port.write(b"hello\n")
        assert port.readline() == b"hello\n"


def test_a_link_has_no_setting_and_understands_the_device() -> None:
    line = SerialLine(BAUD)
    rig = Rig(Station(Changing(), line.a))
    link = SimLink(rig, line.b)
    link.send(b"=9600 8E1\n")
    rig.run_for(5_000)
    link.send(b"hello\n")
    rig.run_for(20_000)
    assert link.receive(0) == b"OK\nhello\n"


def test_a_port_that_is_opened_later_begins_with_the_present_setting() -> None:
    with Bench(Changing(115_200)) as bench:
        bench.link.send(b"=9600 8E1\n")
        bench.run_for("5ms")
        port = bench.serial(timeout=0.1)
        assert (port.baudrate, port.parity) == (9_600, "E")


def test_a_twin_changes_as_the_original() -> None:
    port = changing()
    port.write(b"=9600 8E1\n" + b"x" * 40 + b"\n")
    rig_of(port).run_for(1_100)  # its answer is on its way
    twin = copy.deepcopy(port)
    for each in (twin, port):
        assert each.read(3) == b"OK\n"
        follow(each)
        each.write(b"\nhello\n")
    assert twin.read(100) == port.read(100)
    assert rig_of(twin).now_us == rig_of(port).now_us


def test_a_bench_that_is_restored_changes_again() -> None:
    with Bench(Changing(115_200)) as bench:
        port = bench.serial(timeout=0.1)
        snapshot = bench.snapshot()
        for _ in range(2):
            port.write(b"=9600 8E1\n")
            assert port.readline() == b"OK\n"
            port.write(b"x\n")
            assert port.readline() == b""
            snapshot.restore()


@pytest.mark.parametrize("dense", [False, True])
def test_it_changes_at_the_same_time_at_any_density(dense: bool) -> None:
    line = SerialLine(BAUD)
    rig = Rig(Station(Changing(), line.a), dense=dense)
    port = SimSerial(SerialSide(rig, line.b, SETTING), timeout=0.1)
    port.write(b"=9600 8E1\n" + b"x" * 40 + b"\n")
    assert (port.read(3), rig.now_us, line.a.uart.since_us) == (b"OK\n", 1_300, 1_300)


def test_a_device_on_rs485_cannot_change_it() -> None:
    line = Rs485Line(BAUD)
    rig = Rig(Station(Changing(), line.a))
    line.b.send(0, b"=9600 8E1\n")
    with pytest.raises(ValueError, match="to 9600 8E1: RS-485 keeps 100000 8N1"):
        rig.run_for(5_000)
