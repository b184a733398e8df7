"""Hosts as people write them for pyserial, at devices in virtual time."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest
import serial

from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER


class RrcHost:
    """An own host of an RRC: commands, answers, events, and nothing of ours."""

    def __init__(self, url: str) -> None:
        self.port: Any = serial.serial_for_url(url, 115_200, timeout=0.2)
        self.events: list[bytes] = []

    def command(self, text: str) -> bytes:
        """Return OK or ER, the first answer to a command."""
        self.port.write(text.encode() + b"\n")
        while line := self.port.readline():
            if line.startswith((b"OK:", b"ER:")):
                return bytes(line[:2])
            self.events.append(line)
        raise TimeoutError(text)

    def wait_for(self, event: bytes, tries: int = 50) -> None:
        """Read until an event comes."""
        for _ in range(tries):
            if self.port.readline().strip() == b"EV:" + event:
                return
        raise TimeoutError(event)


@pytest.fixture
def rrc() -> Rrc:
    return Rrc()


@pytest.fixture
def rig(rrc: Rrc) -> Iterator[Rig]:
    line = SerialLine()
    rig = Rig(Station(rrc, line.a))
    with SERIAL_PORTS.offer("rrc", SerialSide(rig, line.b)):
        yield rig


def test_a_host_drives_an_rrc(rig: Rig, rrc: Rrc) -> None:
    host = RrcHost("tickrig://rrc")
    assert (host.command("version"), host.command("output1e00")) == (b"OK", b"ER")
    rrc.inputs.set("power_button", 1)
    host.wait_for(b"PowerOnSuccess")
    assert host.command("speedmode10") == b"OK"
    assert host.command("output1e00") == b"OK"
    host.port.timeout = 1
    assert host.port.read(1) == b""
    assert (rrc.read("state"), rrc.read("out_v_pct")) == ("Output", 30)


def test_a_host_whose_rrc_goes_off_notices_after_its_timeout(rig: Rig, rrc: Rrc) -> None:
    host = RrcHost("tickrig://rrc")
    assert host.command("version") == b"OK"
    rrc.inputs.set("rrc_power", 0)
    host.port.read_all()
    host.port.reset_input_buffer()
    asked_us = rig.now_us
    with pytest.raises(TimeoutError):
        host.command("version")
    assert rig.now_us - asked_us >= 200_000


@dataclass
class Stutterer:
    """Answers each `?` with a line in two halves, `pause_us` apart."""

    pause_us: int
    tick_us: int = 1_000
    _second_us: int = NEVER

    @property
    def due_us(self) -> int:
        return self._second_us

    def reset(self) -> None:
        self._second_us = NEVER

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        out = b""
        if now_us >= self._second_us:
            out, self._second_us = b"42\n", NEVER
        if b"?" in rx:
            out, self._second_us = out + b"VALUE ", now_us + self.pause_us
        return out


def ask_hastily(port: Any) -> bytes:
    """Take what `readline` returns for a line: wrong, for a time-out may be inside of it."""
    port.write(b"?")
    return bytes(port.readline())


def ask_patiently(port: Any) -> bytes:
    """Put the pieces of a line together, for as long as a line may take."""
    port.write(b"?")
    line = b""
    for _ in range(20):
        line += port.readline()
        if line.endswith(b"\n"):
            break
    return line


@pytest.mark.parametrize("pause_ms", [0, 5, 9, 40])
def test_a_timeout_inside_a_line_is_found_each_time(pause_ms: int) -> None:
    for _ in range(20):
        line = SerialLine()
        rig = Rig(Station(Stutterer(pause_ms * 1_000), line.a))
        with (
            SERIAL_PORTS.offer("stutterer", SerialSide(rig, line.b)),
            serial.serial_for_url("tickrig://stutterer", 115_200, timeout=0.010) as port,
        ):
            whole = ask_patiently(port)
            hasty = ask_hastily(port)
        assert whole == b"VALUE 42\n"
        assert hasty == (b"VALUE " if pause_ms > 10 else b"VALUE 42\n")


PROGRAM = """
import hashlib
import serial
from tickrig import Rig, SERIAL_PORTS, SerialLine, SerialSide, Station
from tickrig.device import Rrc

line = SerialLine()
rig = Rig(Station(Rrc(), line.a))
seen = []
with SERIAL_PORTS.offer("rrc", SerialSide(rig, line.b)) as side:
    with serial.serial_for_url("tickrig://rrc", timeout=0.03) as port:
        for baudrate in (9_600, 115_200, 117_000, 57_600, 1_000_000, 115_200):
            port.baudrate = baudrate
            for parity in "NEO":
                port.parity = parity
                port.write(b"version\\nstatusA1\\n")
                seen.append((port.readline(), port.read_until(b"s"), port.read(7), rig.now_us))
            port.send_break(0.001)
            seen.append(port.readlines())
    seen.append((side.transmitter.errors, side.receiver.errors))
print(hashlib.sha256(repr(seen).encode()).hexdigest(), len(seen))
"""


def test_a_run_is_the_same_under_any_hash_seed() -> None:
    runs = set()
    for seed in ("0", "1", "4711"):
        process = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        )
        runs.add(process.stdout)
    assert len(runs) == 1
