"""Faults of a serial line, as hosts with pyserial and masters of others notice them."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import minimalmodbus
import pytest
import serial
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusException

from tests.emulators.changing import Changing
from tests.emulators.echo import Echo
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.commands.run_options import SERIAL_FAULTS
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import SerialSide, UartErrors
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.wire.uart import Parity, UartSetting

ROOT = Path(__file__).parents[3]


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench(Changing(115_200), seed=3) as bench:
        yield bench


def answered(bench: Bench, *requests: bytes, timeout_s: float = 0.05) -> list[bytes]:
    """Send lines as a host with pyserial, and return what it reads before its timeout."""
    port = bench.serial(timeout=timeout_s)
    heard = []
    for request in requests:
        port.write(request + b"\n")
        heard.append(port.readline())
    port.close()
    return heard


@pytest.mark.parametrize(
    ("fault", "received", "heard"),
    [
        ("cut", b"", b""),
        ("cut=way=answer", b"ab\n", b""),
        ("cut=way=request", b"", b""),
        ("drop=way=answer", b"ab\n", b""),
        ("drop=1,way=request", b"", b""),
        ("dup=way=answer", b"ab\n", b"aabb\n\n"),
        ("dup=way=request,rate=1", b"aabb\n\n", b"aabb\n\n"),
        ("dup=way=both", b"aabb\n\n", b"aaaabbbb\n\n\n\n"),
        ("flip=way=answer", b"ab\n", bytes(byte ^ 0xFF for byte in b"ab\n")),
        ("flip=way=request", *2 * [bytes(byte ^ 0xFF for byte in b"ab\n")]),
    ],
)
def test_a_fault_acts_in_one_direction_alone(fault: str, received: bytes, heard: bytes) -> None:
    echo, line, spec = Echo(), SerialLine(), parse_fault_spec(fault)
    port = FaultyPort(line.a, BYTE_FAULTS)
    rig = Rig(Station(echo, port))
    port.arm(spec.name, *spec.arguments)
    line.b.send(0, b"ab\n")
    rig.run_for(50_000)
    assert (echo.heard, line.b.poll(rig.now_us)) == (received, heard)


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ("cut=0.5", "cut takes no argument, got 0.5; write way=answer"),
        ("cut=0", "cut takes no argument, got 0; clear ends it"),
        ("cut=way=up", "cut: way 'up' is not answer or request or both"),
        ("cut=rate=0.5", "cut has no argument 'rate'"),
        ("drop=answer", "'answer' is not a rate"),
        ("drop=0.1,answer", r"'answer' is one argument too many: drop\[=RATE\]"),
    ],
)
def test_a_direction_needs_its_name(fault: str, error: str) -> None:
    port, spec = FaultyPort(SerialLine().a, BYTE_FAULTS), parse_fault_spec(fault)
    with pytest.raises(ValueError, match=error):
        port.arm(spec.name, *spec.arguments)
    assert port.armed == ()


@pytest.mark.parametrize(
    ("fault", "heard"),
    [
        ("cut", [b"", b""]),
        ("drop", [b"", b""]),
        ("dup=1,count=3", [b"aabbcc\n", b"de\n"]),
        ("delay=80ms", [b"", b"abc\n"]),  # it takes the late answer for that to its second request
        ("delay=10ms", [b"abc\n", b"de\n"]),
        ("delay=0.06s,count=1", [b"", b"abc\n"]),
        ("swap", [b"ba\n", b"ced\n"]),
        ("swap=frame", [b"", b"de\n"]),
        ("garbage=behind,place=behind", []),
        ("truncate", [b"ab", b"d"]),
        ("truncate=1", [b"a", b"d"]),
        ("truncate=90%", [b"abc", b"de"]),
        ("repeat", [b"abc\n", b"abc\n"]),
        ("repeat=instead", [b"abc\n", b"abc\n"]),
        ("break", [b"\0abc\n", b"\0de\n"]),
        ("framing", [b"\xb0\xb1\xb1\x85", b"\xb2\xb2\x85"]),
    ],
)
def test_a_host_reads_what_a_fault_leaves(bench: Bench, fault: str, heard: list[bytes]) -> None:
    if not heard:
        with pytest.raises(ValueError, match="bytes: 'behind' is not a whole number"):
            bench.fault(fault)
        return
    bench.fault(fault)
    assert answered(bench, b"abc", b"de") == heard


def test_the_bare_name_of_each_is_a_fault_that_a_host_notices() -> None:
    for name in BYTE_FAULTS:
        with Bench(Changing(115_200), seed=3) as bench:
            port = bench.serial(timeout=0.05)
            bench.fault(name)
            heard = list[object]()
            for request in (b"abc\n", b"defg\n"):
                port.write(request)
                began_us = bench.now_us
                heard.append((port.read(1) + port.read(port.in_waiting), port.readline()))
                heard.append(bench.now_us - began_us > 2_000)
        assert heard != [(b"a", b"bc\n"), False, (b"d", b"efg\n"), False], name


def test_the_names_of_the_command_lines_are_those_of_the_table() -> None:
    assert ", ".join(BYTE_FAULTS) == SERIAL_FAULTS


def test_half_an_answer_is_there_before_the_other_half(bench: Bench) -> None:
    bench.fault("split=20ms")
    port = bench.serial(timeout=0.005)
    port.write(b"0123456789\n")
    assert port.read(100) == b"01234"
    bench.run_for("20ms")
    assert port.read(100) == b"56789\n"


def test_the_pause_of_a_split_is_a_pause_on_a_slow_line() -> None:
    with Bench(Changing(1_200), seed=3) as bench:
        bench.fault("split=3ms,pieces=3")
        port = bench.serial(timeout=1)
        port.write(b"01234567\n")
        times = []
        for _ in range(9):
            port.read(1)
            times.append(bench.now_us)
    gaps = [after - before for before, after in pairwise(times)]
    # a byte takes 8333 us; the pause is rounded up to the next tick of 1 ms
    assert [gap for gap in gaps if gap > 8_400] == [gaps[2], gaps[5]]
    assert all(8_333 + 3_000 <= gap <= 8_334 + 4_000 for gap in (gaps[2], gaps[5]))


def test_garbage_is_before_or_behind_an_answer_by_seed(bench: Bench) -> None:
    bench.fault("garbage=3")
    (before,) = answered(bench, b"abc")
    assert (len(before), before[3:]) == (7, b"abc\n")
    bench.fault("garbage=2,behind,way=answer")
    (behind,) = answered(bench, b"abc")
    assert behind == b"abc\n"
    assert len(bench.link.receive(10_000)) == 2


def test_a_parity_error_turns_over_one_bit_of_a_byte(bench: Bench) -> None:
    bench.fault("parity")
    bench.link.send(b"aaaa\n")
    bench.run_for("5ms")
    heard = bench.link.receive(0)
    assert [(a ^ b).bit_count() for a, b in zip(heard, b"aaaa\n", strict=True)] == [1] * 5


@pytest.mark.parametrize(
    ("fault", "parity", "counted"),
    [
        ("framing=count=2", "N", (UartErrors(framing=2), UartErrors())),
        ("framing=request,count=1", "N", (UartErrors(), UartErrors(framing=1))),
        ("parity=request", "E", (UartErrors(), UartErrors(parity=2))),
        ("parity", "E", (UartErrors(parity=2), UartErrors())),
        ("parity", "N", (UartErrors(), UartErrors())),  # no parity bit, so no UART notices
        ("break=count=1", "N", (UartErrors(breaks=1), UartErrors())),
        ("flip=1", "E", (UartErrors(), UartErrors())),
    ],
)
def test_uarts_count_the_characters_that_a_fault_has_spoiled(
    fault: str, parity: Parity, counted: tuple[UartErrors, UartErrors]
) -> None:
    line = SerialLine()
    port = FaultyPort(line.a, BYTE_FAULTS, seed=3)
    rig = Rig(Station(Changing(115_200), port))
    side = SerialSide(rig, line.b, UartSetting(115_200, parity=parity))
    name, _, words = fault.partition("=")
    port.arm(name, *filter(None, words.split(",")))
    side.transmitter.send(0, b"a\n")
    rig.run_for(50_000)
    side.receiver.poll(rig.now_us)
    assert (side.receiver.errors, side.transmitter.errors) == counted


def test_a_fault_acts_by_line_or_frame_and_on_requests_if_it_is_told_to(bench: Bench) -> None:
    bench.fault("truncate=1,line")
    bench.link.send(b"ab\ncd\n")
    bench.run_for("5ms")
    assert bench.link.receive(0) == b"ac"
    bench.clear("truncate")
    bench.fault("truncate=3,way=request")
    bench.link.send(b"a\nbc\n")
    bench.run_for("5ms")
    assert bench.link.receive(0).startswith(b"a\n")


def test_what_is_late_is_not_told_as_lost(bench: Bench) -> None:
    bench.fault("delay=1ms")
    answered(bench, b"abc")
    assert "hears" not in bench.transcript()
    bench.fault("truncate")
    answered(bench, b"abc")
    assert r"the host hears ab where the device sent abc\n" in bench.transcript()


@pytest.mark.parametrize("fault", ["delay=200ms", "split=100ms", "break=200ms"])
def test_a_late_answer_comes_also_if_its_fault_is_cleared(bench: Bench, fault: str) -> None:
    bench.fault(fault, for_="20ms")
    port = bench.serial(timeout=1)
    port.write(b"abc\n")
    bench.run_for("50ms")
    assert "abc" not in str(port.read(port.in_waiting))
    port.write(b"de\n")  # its answer does not overtake the other
    assert (port.readline() + port.readline()).endswith(b"c\nde\n")
    port.write(b"fg\n")
    bench.run_for("3ms")
    assert port.read(9) == b"fg\n"


def test_a_late_answer_comes_also_if_its_fault_is_armed_again(bench: Bench) -> None:
    bench.fault("delay=200ms")
    port = bench.serial(timeout=1)
    port.write(b"abc\n")
    bench.run_for("50ms")
    bench.fault("delay=10ms")
    port.write(b"de\n")
    assert (port.readline(), port.readline()) == (b"abc\n", b"de\n")


@pytest.mark.parametrize("fault", ["delay=10ms", "jitter=10ms"])
@pytest.mark.parametrize("ways", [("answer", "request"), ("request", "answer"), ("both", "answer")])
def test_what_is_late_comes_also_if_its_fault_is_armed_for_the_other_way(
    bench: Bench, fault: str, ways: tuple[str, str]
) -> None:
    bench.fault(f"delay=200ms,way={ways[0]}")
    if fault.startswith("jitter"):
        bench.fault(f"jitter=200ms,way={ways[0]}")
    port = bench.serial(timeout=1)
    port.write(b"abc\n")
    bench.run_for("50ms")
    if fault.startswith("jitter"):
        bench.fault(f"delay=10ms,way={ways[1]}")
    bench.fault(f"{fault},way={ways[1]}")
    port.write(b"de\n")
    assert (port.readline(), port.readline()) == (b"abc\n", b"de\n")


def test_jitter_delays_by_chance_and_keeps_the_order(bench: Bench) -> None:
    bench.fault("jitter=30ms")
    port = bench.serial(timeout=1)
    times = set()
    for number in range(8):
        began_us = bench.now_us
        port.write(b"%d\n" % number)
        assert port.readline() == b"%d\n" % number
        times.add(bench.now_us - began_us)
    assert len(times) > 4
    assert max(times) < 33_000


def test_a_change_of_the_line_waits_behind_what_is_late(bench: Bench) -> None:
    bench.fault("delay=10ms")
    port = bench.serial(timeout=0.1)
    port.write(b"=9600 8E1\n")
    assert port.readline() == b"OK\n"
    port.baudrate, port.parity = 9_600, "E"
    port.write(b"abc\n")
    assert port.readline() == b"abc\n"


BASE = "tickrig://faulty-base"


@pytest.fixture
def base() -> Iterator[tuple[Rig, FaultyPort[bytes]]]:
    line = Rs485Line()
    port = FaultyPort(line.a, BYTE_FAULTS, seed=3)
    rig = Rig(Station(Rh3Base(BaseParameters()), port))
    with SERIAL_PORTS.offer("faulty-base", SerialSide(rig, line.b)):
        yield rig, port


MODBUS = [
    *("cut", "flip", "drop", "dup", "delay 2s", "swap", "garbage", "truncate", "break", "framing"),
    *("parity", "split 300ms"),
]


@pytest.mark.parametrize("fault", MODBUS)
def test_pymodbus_notices(
    base: tuple[Rig, FaultyPort[bytes]], monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    from pymodbus.client import serial as client  # noqa: PLC0415 - the module with its clock

    rig, port = base
    clock = SimpleNamespace(
        time=lambda: rig.now_us / 1e6, sleep=lambda for_s: rig.run_for(round(for_s * 1e6))
    )
    monkeypatch.setattr(client, "time", clock)
    with ModbusSerialClient(BASE, baudrate=115_200, timeout=0.2, retries=0) as master:
        assert master.read_holding_registers(0, count=2).registers == [0x5248, 0x0100]
        port.arm(*fault.split())
        try:
            answer = master.read_holding_registers(0x10, count=1)
        except ModbusException:
            return
        assert answer.isError()


def test_minimalmodbus_takes_the_answer_before_for_that_to_this_request(
    base: tuple[Rig, FaultyPort[bytes]], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, port = base
    clock = SimpleNamespace(
        monotonic=lambda: rig.now_us / 1e6, sleep=lambda for_s: rig.run_for(round(for_s * 1e6))
    )
    monkeypatch.setattr(minimalmodbus, "time", clock)
    monkeypatch.setattr(minimalmodbus, "_latest_read_times", {})
    with serial.serial_for_url(BASE, 115_200, timeout=0.2) as line:
        master = minimalmodbus.Instrument(line, 1)
        port.arm("repeat", "instead")
        assert master.read_register(0) == 0x5248
        assert master.read_register(1) == 0x5248  # an answer of Modbus RTU names no address
        with pytest.raises(minimalmodbus.InvalidResponseError):
            master.read_registers(0, 2)


@pytest.mark.parametrize("fault", MODBUS)
def test_minimalmodbus_notices(
    base: tuple[Rig, FaultyPort[bytes]], monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    rig, port = base
    clock = SimpleNamespace(
        monotonic=lambda: rig.now_us / 1e6, sleep=lambda for_s: rig.run_for(round(for_s * 1e6))
    )
    monkeypatch.setattr(minimalmodbus, "time", clock)
    monkeypatch.setattr(minimalmodbus, "_latest_read_times", {})
    with serial.serial_for_url(BASE, 115_200, timeout=0.2) as line:
        master = minimalmodbus.Instrument(line, 1)
        assert master.read_registers(0, 2) == [0x5248, 0x0100]
        port.arm(*fault.split())
        with pytest.raises((minimalmodbus.ModbusException, ValueError)):
            master.read_register(0x10)


IN_REAL_TIME = {"delay": "300ms", "jitter": "2s", "split": "300ms", "flip": "0.2"}
"""Arguments with which a host with a timeout of 0.1 s notices."""


@pytest.mark.realtime
@pytest.mark.parametrize("name", BYTE_FAULTS)
def test_a_host_on_a_pty_notices(name: str) -> None:
    with Bench(Changing(115_200), mode="real", seed=3) as bench:
        port = bench.serial(timeout=5)
        port.write(b"abc\n")
        assert port.readline() == b"abc\n"
        bench.fault(f"{name}={IN_REAL_TIME[name]}" if name in IN_REAL_TIME else name)
        port.timeout = 0.1
        heard = list[bytes]()
        for request in (b"abc\n", b"defg\n", b"hijkl\n"):
            port.write(request)
            heard.append(port.readline())
        assert heard != [b"abc\n", b"defg\n", b"hijkl\n"]


def session(seed: int, *, dense: bool = False) -> str:
    """Return a hash of what hosts hear of lines with each fault, and when."""
    heard = hashlib.sha256()
    for name in BYTE_FAULTS:
        for words in ((), ("rate=0.5",), ("count=2",)):
            if BYTE_FAULTS[name].rated or not words:
                line = SerialLine(9_600)
                port = FaultyPort(line.a, BYTE_FAULTS, seed)
                port.arm(name, *words)
                rig = Rig(Station(Changing(9_600), port), dense=dense)
                link = SimLink(rig, line.b)
                for number in range(6):
                    link.send(b"line %d\nmore\n" % number)
                    data = link.receive(70_000)
                    heard.update(b"%s %s %d %d\n" % (name.encode(), data, rig.now_us, number))
    return heard.hexdigest()


def test_faults_are_the_same_for_each_hash_seed_dense_and_sparse() -> None:
    program = "from tests.emulators.serial.test_byte_faults import session; print(session(7))"
    path = os.pathsep.join([str(ROOT), str(ROOT / "src")])
    found = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        for seed in map(str, range(10))
    }
    assert found == {session(7), session(7, dense=True)}
    assert session(8) != session(7)


@pytest.mark.parametrize("name", BYTE_FAULTS)
def test_a_fault_survives_fork_and_snapshot(name: str) -> None:
    with Bench(Changing(115_200), seed=3) as bench:
        bench.fault(name)
        bench.link.send(b"abc\n")
        bench.run_for("1ms")
        twin, snapshot = bench.fork(), bench.snapshot()
        heard = []
        for each in (bench, twin, bench):
            each.link.send(b"defg\n")
            each.run_for("150ms")
            heard.append(each.link.receive(0))
            if each is bench:
                snapshot.restore()
        assert heard[0] == heard[1] == heard[2]
