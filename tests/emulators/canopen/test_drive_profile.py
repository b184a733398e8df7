"""The canopen library's own profile for drives at an EPOS-like drive on a rig."""

from __future__ import annotations

import io
from typing import Any

import pytest
from canopen.profiles.p402 import BaseNode402

from tickrig.device.canopen.models import epos
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.canopen.drive import DriveState
from tickrig.wire.canopen.eds.eds_writer import write_eds

RIGHT_WHEEL = 2


class Bench:
    """A drive as the library sees it, with K21's PDOs and an event timer, unless that is 0."""

    def __init__(self, event_timer_ms: int = 20, *, starts_first: bool = False) -> None:
        wire = CanWire()
        self.slave = epos.make_epos(RIGHT_WHEEL)
        self.emulated = epos.Epos.of(self.slave)
        self.rig = Rig(Station(self.slave, wire.end()))
        self.network = SimNetwork(self.rig, wire.end())
        kind: Any = BaseNode402
        self.node: Any = kind(RIGHT_WHEEL, _eds())
        self.network.add_node(self.node)
        self.run_ms(10)
        self.node.tpdo[1].read()
        self.node.tpdo[1].event_timer = event_timer_ms
        self.node.tpdo[1].save()
        if not starts_first:
            self.node.setup_402_state_machine()
        self.node.nmt.state = "OPERATIONAL"
        self.run_ms(50)
        if starts_first:
            self.node.setup_402_state_machine()

    def run_ms(self, milliseconds: int) -> None:
        self.network.run_for(1_000 * milliseconds)

    def turn(self, velocity: int) -> None:
        target = self.node.rpdo_pointers[0x60FF]
        target.raw = velocity
        target.pdo_parent.transmit()


def _eds() -> io.StringIO:
    file = io.StringIO(write_eds(epos.dictionary().description))
    file.name = "epos.eds"
    return file


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_the_library_finds_controlword_and_statusword_in_pdos(bench: Bench) -> None:
    assert 0x6040 in bench.node.rpdo_pointers
    assert 0x6041 in bench.node.tpdo_values
    assert bench.node.state == "SWITCH ON DISABLED"


def test_the_library_leads_the_drive_through_its_states(bench: Bench) -> None:
    for name, state in (
        ("READY TO SWITCH ON", DriveState.READY_TO_SWITCH_ON),
        ("SWITCHED ON", DriveState.SWITCHED_ON),
        ("OPERATION ENABLED", DriveState.OPERATION_ENABLED),
        ("SWITCHED ON", DriveState.SWITCHED_ON),
        ("OPERATION ENABLED", DriveState.OPERATION_ENABLED),
        ("SWITCH ON DISABLED", DriveState.SWITCH_ON_DISABLED),
    ):
        bench.node.state = name
        assert bench.node.state == name
        assert bench.emulated.state is state


def test_the_library_turns_a_wheel_by_profile_velocity(bench: Bench) -> None:
    bench.node.op_mode = "PROFILED VELOCITY"
    assert bench.node.op_mode == "PROFILED VELOCITY"
    bench.node.state = "OPERATION ENABLED"
    bench.turn(600)
    bench.run_ms(500)
    assert bench.node.sdo[0x606C].raw == pytest.approx(600, abs=2)
    before = bench.node.tpdo_values[0x6064]
    bench.run_ms(1_000)
    assert bench.node.tpdo_values[0x6064] - before == pytest.approx(20_000, abs=800)
    assert bench.node.statusword & 0x0400
    assert bench.emulated.read("shaft_deg_s") == pytest.approx(3_600 / 51, abs=0.5)


@pytest.mark.parametrize(
    "mode",
    [
        *("PROFILED POSITION", "PROFILED VELOCITY", "PROFILED TORQUE", "HOMING"),
        *("INTERPOLATED POSITION", "CYCLIC SYNCHRONOUS POSITION"),
        *("CYCLIC SYNCHRONOUS VELOCITY", "CYCLIC SYNCHRONOUS TORQUE"),
    ],
)
def test_the_library_chooses_each_mode(bench: Bench, mode: str) -> None:
    bench.node.state = "OPERATION ENABLED"
    bench.node.op_mode = mode
    assert bench.node.op_mode == mode


@pytest.mark.parametrize("method", [35, 37])
@pytest.mark.parametrize("starts_first", [False, True])
def test_the_library_homes(method: int, starts_first: bool) -> None:
    bench = Bench(starts_first=starts_first)
    bench.node.sdo[0x6098].raw = method
    bench.node.sdo[0x607C].raw = 1_234
    assert bench.node.homing()
    bench.run_ms(50)
    assert bench.node.tpdo_values[0x6064] == 1_234
    assert bench.node.is_homed()


@pytest.mark.parametrize("method", [35, 37])
def test_without_an_event_timer_the_library_does_not_see_that_the_drive_has_homed(
    method: int,
) -> None:
    bench = Bench(event_timer_ms=0)
    bench.node.sdo[0x6098].raw = method
    assert not bench.node.homing()
    assert bench.node.sdo[0x6041].raw & 0x3400 == 0x1400


def test_without_an_event_timer_the_library_has_to_be_set_up_before_nmt_start() -> None:
    bench = Bench(event_timer_ms=0, starts_first=True)
    with pytest.raises(RuntimeError, match="Timeout when trying to change state"):
        bench.node.state = "OPERATION ENABLED"


def test_the_library_homes_by_a_switch_and_an_index_pulse(bench: Bench) -> None:
    bench.emulated.inputs.set("home_from", 10.0)
    bench.emulated.inputs.set("home_to", 11.0)
    bench.node.sdo[0x6098].raw = 7
    bench.node.sdo[0x6099][1].raw = 600
    assert bench.node.homing()
    bench.run_ms(500)
    assert abs(bench.node.tpdo_values[0x6064]) <= 4
    assert bench.emulated.read("shaft_deg") == pytest.approx(360 / 51, abs=0.02)
    bench.node.op_mode = "PROFILED POSITION"
    assert bench.node.is_homed(restore_op_mode=True)


def test_the_library_does_not_home_against_a_limit_switch(bench: Bench) -> None:
    bench.node.sdo[0x6098].raw = 19
    bench.emulated.inputs.set("positive_limit_at", 3.0)
    assert not bench.node.homing()
    assert not bench.node.is_homed()


def test_the_library_resets_a_fault(bench: Bench) -> None:
    bench.node.op_mode = "PROFILED VELOCITY"
    bench.node.state = "OPERATION ENABLED"
    bench.emulated.inputs.set("short_circuit", 1)
    bench.run_ms(50)
    assert bench.node.is_faulted()
    bench.emulated.inputs.set("short_circuit", 0)
    bench.node.reset_from_fault()
    assert bench.node.state == "OPERATION ENABLED"
