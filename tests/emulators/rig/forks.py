"""Rigs for the tests of `Rig.fork`, and what is done to them; other processes import it too."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any

from tests.emulators.can.test_can_rig import Node
from tests.emulators.echo import Echo
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.canopen.models.motor_core_unit import make_motor_core_unit
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node as CanopenNode
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.can import CanFrame
from tickrig.wire.modbus import encode_frame

Act = tuple[int, str, Any]
"""How long to wait, what to do then, and with what."""


@dataclass
class Bench:
    """A rig, the ends where its hosts are, and where faults are armed."""

    rig: Rig
    ends: list[Any]
    faults: Any

    def fork(self) -> Bench:
        rig, ends, faults = self.rig.fork(self.ends, self.faults)
        return Bench(rig, ends, faults)

    def act(self, acts: list[Act]) -> list[object]:
        """Do something, and return what the hosts hear and how the rig is."""
        heard: list[object] = []
        for wait_us, verb, what in acts:
            self.rig.run_for(wait_us)
            if verb == "send":
                end = self.ends[what[0] % len(self.ends)]
                frames = isinstance(end, CanEnd)
                end.send(
                    self.rig.now_us, tuple(map(CanFrame.parse, what[1])) if frames else what[1]
                )
            elif verb == "arm":
                self.faults.arm(*what)
            elif verb == "clear":
                self.faults.clear(what)
            else:
                number, name, value = what
                self.rig.stations[number].device.inputs.set(name, value)
            heard += [(self.rig.now_us, self.rig.next_us)]
            heard += [end.poll(self.rig.now_us) for end in self.ends]
        return heard


def go_on(pickled: bytes, acts: list[Act]) -> list[object]:
    """Go on in another process."""
    bench: Bench = pickle.loads(pickled)
    return bench.act(acts)


def serial() -> Bench:
    line = SerialLine()
    port = FaultyPort(line.a, BYTE_FAULTS, seed=7)
    return Bench(Rig(Station(Rrc(), port)), [line.b], port)


def rs485() -> Bench:
    line = Rs485Line(19_200, ends=4, bursts=True)
    port = FaultyPort(line.ends[0], BYTE_FAULTS, seed=3)
    devices: tuple[Any, ...] = (Rh3Base(), Echo(1_000), Echo(1_000, period_us=40_000))
    ports: tuple[Any, ...] = (port, *line.ends[2:])
    return Bench(
        Rig(*(Station(*pair) for pair in zip(devices, ports, strict=True))), [line.b], port
    )


def can() -> Bench:
    wire = CanWire(125_000, seed=5)
    nodes = [
        Node(
            number, period_us=number * 7_000, accepts=frozenset({0x100, 0x101, 0x200 + number - 1})
        )
        for number in range(1, 6)
    ]
    hosts = [wire.end(), wire.end(frozenset({0x201, 0x202}))]
    hosts[0].auto_recovery = True
    return Bench(Rig(*(Station(node, wire.end()) for node in nodes)), hosts, wire.faults)


def canopen() -> Bench:
    """Devices of CANopen, and one with a plug and a supply."""
    wire = CanWire(500_000, seed=1)
    slaves = (make_f_palette(1), make_epos(2), make_motor_core_unit(3))
    node = CanopenNode("drive", make_epos(4), wire)
    stations = [*(Station(slave, wire.end()) for slave in slaves), Station(node, node.port)]
    bench = Bench(Rig(*stations), [wire.end()], wire.faults)
    bench.act([(10_000, "send", (0, ["000#0100"])), (10_000, "send", (0, ["080#"]))])
    node.physical["unplugged"].write(1)
    node.physical["emergency"].write(0x3100)
    bench.act([(20_000, "send", (0, []))])
    node.physical["unplugged"].write(0)
    return bench


def both() -> Bench:
    """A rig with a bus and lines, in which everybody is looked at in each tick."""
    wire, line = CanWire(), SerialLine(9_600)
    node, echo = Node(1, 5_000, 20_000), Echo(2_000)
    stations: list[Station[Any]] = [Station(node, wire.end()), Station(echo, line.a)]
    return Bench(Rig(*stations, dense=True), [wire.end(), line.b], wire.faults)


STATUS = encode_frame(1, bytes((3, 2, 0, 0, 12)))
