"""The physical side of a node's application, by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.emulators.canopen.dimmer import Dimmer
from tickrig.device.canopen.stack import make_slave
from tickrig.device.physical import SignalType
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import make_bench
from tickrig.emulators.canopen.eds import read_eds
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.scenario import ScenarioParser

DESCRIPTION = read_eds(Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds")


def dimmers(*ids: int) -> CanEmulator:
    wire = CanWire()
    slaves = [make_slave(DESCRIPTION.make_dictionary(), n, application=Dimmer) for n in ids]
    return make_bench(wire, [Node(str(n), s, wire) for n, s in zip(ids, slaves, strict=True)])


def ask(bench: CanEmulator, **request: object) -> dict[str, Any]:
    answer = EmulatorControl(bench).answer({"v": 1, **request})
    assert answer["ok"], answer
    return answer


def test_an_input_of_the_device_acts_at_its_next_tick() -> None:
    bench = dimmers(5)
    bench.rig.run_to(10_000)
    bench.operator.set("knob_v", 2.5)
    assert (bench.device.inputs["knob_v"], bench.device.read("lamp_pct")) == (2.5, 0)
    bench.rig.run_to(11_000)
    assert bench.device.read("lamp_pct") == 50


def test_an_input_keeps_its_value_without_power() -> None:
    bench = dimmers(5)
    bench.rig.run_to(10_000)
    for name, value in (("power_off", 1), ("knob_v", 4), ("power_off", 0), ("knob_v", 5)):
        bench.operator.set(name, value)
        bench.rig.run_for(5_000)
    assert bench.device.read("lamp_pct") == 100


def test_a_group_is_set_in_one_go() -> None:
    bench = dimmers(5, 6)
    bench.operator.set("6/di", 1, 1)
    bench.rig.run_to(5_000)
    inputs = bench.device.inputs
    assert (inputs["5/0x6000:1"], inputs["6/0x6000:1"]) == (0, 3)
    assert inputs.groups == {"5/di": ("5/di1", "5/di2"), "6/di": ("6/di1", "6/di2")}


def test_a_physical_fault_comes_and_goes_and_the_device_tells_it() -> None:
    bench = dimmers(5)
    assert "burnt" in bench.operator.faults
    bench.operator.fault(0, parse_fault_spec("burnt@20ms-30ms"))
    while bench.rig.now_us < 40_000 and bench.event_queue.due_us < 40_000:
        bench.step()
    bench.rig.run_to(40_000)
    bench.step()
    heard = [line.data.decode().strip() for line in bench.log.since(0)]
    assert heard == ["705#00", "085#0050010000000000", "085#0000000000000000"]


def test_a_button_is_pressed_for_a_time() -> None:
    bench = dimmers(5)
    bench.rig.run_to(10_000)
    bench.operator.press(10_000, "bell", 20_000)
    bench.rig.run_to(15_000)
    assert bench.device.inputs["0x6000:1"] == 4
    bench.step()
    bench.rig.run_to(50_000)
    assert bench.device.inputs["0x6000:1"] == 0


def test_the_control_socket_knows_it_all() -> None:
    bench = dimmers(5, 6)
    ask(bench, do="set", name="5/knob_v", value=2.5)
    ask(bench, do="fault", spec="6/burnt")
    bench.rig.run_to(10_000)
    values = ask(bench, do="get", names=["5/lamp_pct", "5/knob_v", "6/burnt"])["values"]
    assert values == {"5/lamp_pct": 50, "5/knob_v": 2.5, "6/burnt": 1}
    outputs = ask(bench, do="describe")["outputs"]
    assert {"name": "6/lamp_pct", "text": "brightness", "unit": "%"} in outputs


@pytest.mark.parametrize(
    ("act", "error"),
    [
        (lambda bench: bench.operator.set("knob_v", 5.5), r"knob_v 5.5 is not in 0..5 V"),
        (lambda bench: bench.operator.set("di1", 0.5), r"di1 takes a whole number, not 0.5"),
        (lambda bench: bench.operator.set("di", 1), r"di takes 2 values \(di1, di2\), got 1"),
        (lambda bench: bench.operator.set("knob_v", "high"), r"knob_v takes a number, not 'high'"),
    ],
)
def test_a_wrong_value_says_what_is_allowed(act: Callable[[CanEmulator], None], error: str) -> None:
    with pytest.raises(ValueError, match=error):
        act(dimmers(5))


def test_a_scenario_names_them() -> None:
    bench = dimmers(5)
    text = (
        "1ms set knob_v 2.5\n+0s set di 1 0\n+0s press bell\n+0s watch lamp_pct\n2ms fault burnt\n"
    )
    assert len(ScenarioParser(bench.device, bench.operator).parse(text, "x")) == 5
    assert bench.device.inputs.find("burnt", SignalType.FAULT).text == "its filament is gone"
