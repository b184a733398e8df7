"""Whoever makes time pass runs what is due, before the tick of its time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.canopen.dimmer import Dimmer
from tests.emulators.lamp import Lamp
from tickrig.device.canopen.stack import make_slave
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.bench.running_emulator import Transcript
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.outside.interface import CHANNELS
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import make_bench
from tickrig.emulators.canopen.eds import read_eds
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import RigClock, SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.scenario import ScenarioParser, ScenarioPlayer
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rrc import RrcClient
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc.replies import RrcEvent

DESCRIPTION = read_eds(Path(__file__).parents[2] / "golden" / "canopen" / "r1.eds")
TO_US = 4_000_000

Drive = Callable[[Emulator], object]
CanDrive = Callable[[CanEmulator, CanWire], object]


def listen_by_link(emulator: Emulator) -> None:
    link = SimLink(emulator.rig, emulator.host_end)
    while (left_us := TO_US - link.now_us) > 0:
        link.receive(left_us)


def send_by_link(emulator: Emulator) -> None:
    """Time passes while a long text waits for room in the buffer."""
    link = SimLink(emulator.rig, emulator.host_end)
    while link.now_us < TO_US:
        link.send(bytes(5_000))


def step(emulator: Emulator | CanEmulator) -> None:
    emulator.event_queue.put("end", TO_US + 1, lambda now_us: None)
    while emulator.rig.now_us < TO_US:
        emulator.step()


DRIVES: dict[str, Drive] = {
    "SimLink.receive": listen_by_link,
    "SimLink.send": send_by_link,
    "RigClock": lambda emulator: RigClock(emulator.rig).wait_until(TO_US),
    "Rig.run_to": lambda emulator: emulator.rig.run_to(TO_US),
    "Rig.run_until": lambda emulator: emulator.rig.run_until(lambda: False, TO_US),
    "Emulator.step": step,
}


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
def test_on_a_line_faults_come_and_go_and_buttons_are_released(drive: Drive) -> None:
    emulator, seen = Emulator("lamp", Lamp(b"")), list[tuple[int, str]]()
    emulator.operator.note = lambda text: seen.append((emulator.effective_us, text))
    emulator.operator.press(0, "key", 1_500_500)
    emulator.operator.fault(0, parse_fault_spec("cut@2s-3s"))
    drive(emulator)
    assert seen == [(0, "key=1"), (1_500_500, "key=0"), (2_000_000, "cut"), (3_000_000, "cut=0")]


def listen_by_network(emulator: CanEmulator, wire: CanWire) -> None:
    SimNetwork(emulator.rig, wire.end()).run_for(TO_US)


def listen_by_host(emulator: CanEmulator, wire: CanWire) -> None:
    CanHost(emulator.rig, wire.end(frozenset())).receive(TO_US)


def listen_by_python_can(emulator: CanEmulator, wire: CanWire) -> None:
    with (
        CHANNELS.offer("robot", emulator.rig, wire),
        can.Bus(interface="tickrig", channel="robot") as bus,
    ):
        while emulator.rig.now_us < TO_US:
            bus.recv((TO_US - emulator.rig.now_us) / 1e6)


CAN_DRIVES: dict[str, CanDrive] = {
    "SimNetwork": listen_by_network,
    "CanHost": listen_by_host,
    "python-can": listen_by_python_can,
    "CanEmulator.step": lambda emulator, wire: step(emulator),
}


@pytest.mark.parametrize("drive", CAN_DRIVES.values(), ids=CAN_DRIVES)
def test_on_a_bus_faults_come_and_go_and_what_is_planned_is_done(drive: CanDrive) -> None:
    wire = CanWire()
    slave = make_slave(DESCRIPTION.make_dictionary(), 5, application=Dimmer)
    emulator, seen = make_bench(wire, [Node("5", slave, wire)]), list[tuple[int, str]]()
    emulator.operator.note = lambda text: seen.append((emulator.effective_us, text))
    emulator.operator.fault(0, parse_fault_spec("short@2s-3s"))
    emulator.event_queue.put("turn", 1_500_500, lambda now_us: emulator.operator.set("knob_v", 2.5))
    drive(emulator, wire)
    assert seen == [(1_500_500, "knob_v=2.5"), (2_000_000, "short"), (3_000_000, "short=0")]
    assert emulator.device.read("lamp_pct") == 50


def test_a_button_pressed_beside_a_client_is_released() -> None:
    emulator = Emulator("rrc", rrc := Rrc())
    client = RrcClient(SimLink(emulator.rig, emulator.host_end))
    client.start()
    emulator.operator.press(emulator.effective_us, "power_button", 300_000)
    client.wait_for(RrcEvent.POWER_ON_SUCCESS, 5_000_000)
    client.run_for(300_000)
    assert rrc.inputs["power_button"] == 0


def test_a_scenario_is_played_while_a_link_waits() -> None:
    emulator, shown = Emulator("lamp", Lamp(b"")), list[str]()
    lines = ScenarioParser(emulator.device, emulator.operator).parse(
        "10ms press key for 5ms\n+0ms expect click within 20ms\n20ms send hello\n30ms set lamp 0\n",
        "test",
    )
    player = ScenarioPlayer(emulator, lines, Transcript(emulator, shown.append), stays=True)
    link = SimLink(emulator.rig, emulator.host_end)
    heard = b""
    while link.now_us < 50_000:
        heard += link.receive(50_000 - link.now_us)
    assert heard == b"click\nhello\n"
    assert (player.met, player.missed) == (1, 0)
    assert emulator.device.inputs["lamp"] == 0


@pytest.mark.parametrize("dense", [False, True])
def test_what_is_due_comes_before_the_tick_of_its_time_and_after_all_before(dense: bool) -> None:
    class Clicks(Lamp):
        def tick(self, now_us: int, rx: bytes, /) -> bytes:
            if self.inputs.changed:
                seen.append(("tick", now_us))
            return super().tick(now_us, rx)

    seen = list[tuple[str, int]]()
    lamp = Clicks(b"")
    rig = Rig(Station(lamp, Emulator("line", Lamp()).line.a), dense=dense)

    def touch(now_us: int) -> None:
        seen.append(("touch", now_us))
        lamp.inputs.set("lamp", 0 if lamp.inputs["lamp"] else 1)

    for at_us in (2_000, 2_500, 4_000):
        rig.event_queue.put(at_us, at_us, touch)
    rig.run_to(1_000)
    assert seen.pop() == ("tick", 1_000)  # the first, at power-on
    rig.run_to(3_999)
    assert seen == [("touch", 2_000), ("tick", 2_000), ("touch", 2_500), ("tick", 3_000)]
    rig.run_to(4_000)
    assert seen[4:] == [("touch", 4_000), ("tick", 4_000)]


def test_what_is_due_at_once_is_done_without_a_tick_more() -> None:
    ticks = list[int]()

    class Counted(Lamp):
        def tick(self, now_us: int, rx: bytes, /) -> bytes:
            ticks.append(now_us)
            return super().tick(now_us, rx)

    emulator, done = Emulator("lamp", Counted(b"")), list[int]()
    emulator.event_queue.put("first", 0, done.append)
    emulator.rig.run_to(5_000)
    emulator.event_queue.put("late", 3_000, done.append)
    emulator.rig.run_for(0)
    assert (done, ticks, emulator.rig.now_us) == ([0, 5_000], [1_000], 5_000)
    assert emulator.rig.next_us == NEVER


def test_an_action_that_fails_is_over() -> None:
    emulator = Emulator("lamp", Lamp(b""))
    emulator.event_queue.put("bad", 7_000, lambda now_us: emulator.operator.set("lamp", 2))
    with pytest.raises(ValueError, match="lamp 2 is not in"):
        emulator.rig.run_to(10_000)
    assert emulator.effective_us == 7_000
    emulator.rig.run_to(10_000)
    assert emulator.effective_us == 11_000


@given(st.lists(st.tuples(st.integers(0, 20_000), st.sampled_from(["lamp", "key", "dead"]))))
def test_dense_and_sparse_runs_are_the_same_whatever_is_done(
    input_changes: list[tuple[int, str]],
) -> None:
    def heard(*, dense: bool) -> list[tuple[int, bytes]]:
        line, lamp = SerialLine(), Lamp()
        rig = Rig(Station(lamp, line.a), dense=dense)
        link, lines = SimLink(rig, line.b), list[tuple[int, bytes]]()

        def toggle(name: str, now_us: int) -> None:
            lamp.inputs.set(name, 1 - lamp.inputs[name])

        for number, (at_us, name) in enumerate(input_changes):
            rig.event_queue.put(number, at_us, partial(toggle, name))
        while link.now_us < 30_000:
            link.send(b"x")
            lines.append((link.now_us, link.receive(3_000)))
        return lines

    assert heard(dense=True) == heard(dense=False)
