"""The RRC in virtual time, on one core."""

from __future__ import annotations

from itertools import count

from benchmarks.table import rates
from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.commands import Output, StableMode, Status

SECONDS = 20


class Bench:
    """An RRC in Standby, on a line."""

    def __init__(self) -> None:
        self.line, self.rrc = SerialLine(), Rrc()
        self.rig = Rig(Station(self.rrc, self.line.a))
        for pressed in (1, 0):
            self.rig.run_for(3 * TICK_US)
            self.rrc.inputs.set("power_button", pressed)
        self.rig.run_for(40 * TICK_US)

    def say(self, data: bytes) -> None:
        """Send bytes and let a tick pass."""
        self.line.b.send(self.rig.now_us, data)
        self.rig.run_for(TICK_US)


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    streaming()
    bare()
    idle()
    client()
    pyserial_host()


def streaming() -> None:
    """Stream status lines and take two new commands a tick: as much as an RRC bears."""
    bench = Bench()
    for command in (Status(1).encode(), StableMode(1).encode()):
        bench.say(command)
    commands = [Output(v, w).encode(check=True) for v in range(-100, 101, 4) for w in range(50)]
    numbers = count()

    def work() -> None:
        for _ in range(SECONDS * 100):
            number = next(numbers)
            bench.line.b.poll(bench.rig.now_us)
            pair = commands[number % 2_500] + commands[number * 7 % 2_500]
            bench.say(pair)
        assert bench.rrc.read("state") == "Output"

    rates("RRC, status lines and 2 commands a tick, rig and line", SECONDS, "x real time", work)


def bare() -> None:
    """Stream status lines without a host."""
    bench = Bench()
    bench.say(Status(1).encode())
    work = lambda: bench.rig.run_for(SECONDS * 1_000_000)  # noqa: E731 - one line says it
    rates("RRC, status lines only", SECONDS, "x real time", work)


def idle() -> None:
    """Wait in Standby with a watchdog off and nobody talking: an hour at a time."""
    bench = Bench()

    def work() -> None:
        for _ in range(3_600):
            bench.rig.run_for(1_000_000)

    rates("RRC, idle in Standby", 3_600, "x real time", work)


def client() -> None:
    """Let the host client confirm one output command after the other."""
    bench = Bench()
    client = RrcClient(SimLink(bench.rig, bench.line.b))
    client.start()
    calls = 2_000

    def work() -> None:
        for number in range(calls):
            client.output(number % 100, 0)

    rates("RrcClient.output with its OK, virtual time", calls, "calls/s", work)


def pyserial_host() -> None:
    """Let a host with pyserial ask for the version, and read its two lines."""
    bench = Bench()
    port = SimSerial(SerialSide(bench.rig, bench.line.b), timeout=0.5)
    calls = 2_000

    def work() -> None:
        for _ in range(calls):
            port.write(b"version\n")
            assert port.readline() == b"OK:version\n"
            assert port.readline() == b"Version 1.0\n"

    rates("a command and two readline of pyserial, virtual time", calls, "calls/s", work)
