from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.device.canopen.stack import make_slave
from tickrig.device.physical import SignalType
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import make_bench
from tickrig.emulators.canopen.eds import read_eds
from tickrig.emulators.canopen.node import Node

EDS = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"
DESCRIPTION = read_eds(EDS)


class Bench:
    """Nodes in virtual time, and what was heard of them."""

    def __init__(self, *ids: int) -> None:
        wire = CanWire()
        self.nodes = [Node(str(n), make_slave(DESCRIPTION.make_dictionary(), n), wire) for n in ids]
        self.emulator: CanEmulator = make_bench(wire, self.nodes)
        self.physical = self.emulator.device

    def run(self, to_ms: int, *frames: str) -> list[str]:
        for frame in frames:
            self.emulator.send(self.emulator.rig.now_us, frame.encode())
        seen = len(self.emulator.log.since(0))
        self.emulator.rig.run_to(to_ms * 1_000)
        self.emulator._listen(to_ms * 1_000)
        return [line.data.decode() for line in self.emulator.log.since(0)[seen:]]

    def set(self, name: str, value: int) -> None:
        self.emulator.operator.set(name, value)


def test_what_is_set_from_the_inside_takes_effect_at_the_next_tick() -> None:
    bench = Bench(5)
    assert bench.run(100) == ["705#00"]
    bench.set("0x1017", 20)
    assert bench.physical.inputs["0x1017"] == 0
    assert bench.run(145) == ["705#7F", "705#7F"]
    assert bench.physical.inputs["0x1017"] == 20


def test_what_is_set_before_the_first_tick_outlives_the_power_on() -> None:
    bench = Bench(5)
    bench.set("0x6000:1", 0x5A)
    bench.run(10)
    assert bench.physical.inputs["0x6000:1"] == 0x5A


def test_a_node_without_power_is_silent_and_boots_when_it_is_back() -> None:
    bench = Bench(5)
    bench.run(5)
    bench.run(10, "000#0105")
    assert bench.physical.read("state") == "Operational"
    bench.set("power_off", 1)
    assert bench.physical.read("state") == "Off"
    bench.set("0x6000:1", 1)
    assert bench.run(20, "605#4000100000000000") == []
    bench.set("power_off", 0)
    assert bench.physical.read("state") == "Off"
    assert bench.run(30) == ["705#00"]
    assert bench.physical.read("state") == "Pre-operational"
    assert bench.physical.inputs["0x6000:1"] == 0


def test_what_a_node_had_to_send_is_lost_with_its_power() -> None:
    bench = Bench(5)
    bench.run(10)
    bench.emulator.operator.fault(10_000, parse_fault_spec("short"))
    bench.run(12, "605#4000100000000000")
    bench.set("power_off", 1)
    bench.emulator.operator.clear("short")
    bench.run(20)
    bench.set("power_off", 0)
    assert bench.run(30) == ["705#00"]


def test_a_pulled_plug_keeps_what_it_had_to_send() -> None:
    bench = Bench(5)
    bench.run(10)
    bench.set("unplugged", 1)
    bench.set("0x1017", 50)
    assert bench.run(70) == []
    assert bench.physical.read("can_state") == "error-passive"
    bench.set("unplugged", 0)
    assert bench.run(75)[0] == "705#7F"


def test_a_plug_that_is_put_back_in_a_node_without_power_changes_nothing() -> None:
    bench = Bench(5)
    bench.run(10)
    for name, value in (("power_off", 1), ("unplugged", 1), ("unplugged", 0)):
        bench.set(name, value)
    assert bench.run(20, "605#4000100000000000") == []
    bench.set("unplugged", 1)
    bench.set("power_off", 0)
    assert bench.run(30) == []
    bench.set("unplugged", 0)
    assert bench.run(40)[0] == "705#00"


def test_an_emergency_is_told_replaced_and_cleared() -> None:
    bench = Bench(5)
    bench.run(10)
    for code, heard in (
        (0x3110, ["085#1031050000000000"]),
        (0x4210, ["085#0000000000000000", "085#1042090000000000"]),
        (0, ["085#0000000000000000"]),
    ):
        bench.set("emergency", code)
        frames = bench.run(bench.emulator.rig.now_us // 1_000 + 5)
        assert sorted(frames) == sorted(heard)
    assert bench.physical.inputs["emergency"] == 0


@pytest.mark.parametrize(("code", "register"), [(0x1000, 1), (0x2310, 3), (0x8130, 0x11)])
def test_the_error_register_follows_the_code(code: int, register: int) -> None:
    bench = Bench(5)
    bench.run(10)
    bench.set("emergency", code)
    bench.run(20)
    assert bench.physical.inputs["0x1001"] == register


def test_a_node_that_is_bus_off_comes_back_and_tells_it() -> None:
    bench = Bench(5)
    bench.run(10)
    bench.emulator.operator.fault(10_000, parse_fault_spec("corrupt=1"))
    bench.set("0x1017", 10)
    bench.run(40)
    bench.emulator.operator.clear("corrupt")
    assert "085#4081110000000000" in bench.run(100)


def test_the_things_of_several_nodes_have_the_node_before_them() -> None:
    bench = Bench(5, 6)
    bench.run(10)
    bench.set("6/0x6000:1", 7)
    bench.run(20)
    inputs = bench.physical.inputs
    assert (inputs["5/0x6000:1"], inputs["6/0x6000:1"]) == (0, 7)
    assert bench.physical.read("6/node_id") == 6
    assert "5/power_off" in bench.emulator.operator.faults
    assert inputs.table["6/0x1017:0"].name == "6/0x1017"
    assert len(inputs.table) == len(list(inputs.table))
    hint = r"known: [56]/power_off, .* in all|did you mean '5/"
    for name in ("0x1000", "7/0x1000", "6/0x5000", "6/"):
        assert name not in inputs.table
        with pytest.raises(ValueError, match=f"no input '.*'; ({hint})"):
            inputs.set(name, 0)
    for name in ("state", "7/state", "6/smell"):
        with pytest.raises(KeyError):
            bench.physical.read(name)
    with pytest.raises(KeyError):
        inputs.table["7/x"]


def test_an_input_is_found_by_its_kind() -> None:
    inputs = Bench(5).physical.inputs
    assert inputs.find("power_off", SignalType.FAULT).text == "its supply is cut"
    with pytest.raises(ValueError, match="no button '0x1017'; known: none"):
        inputs.find("0x1017", SignalType.BUTTON)
    assert "0x6000:1" in inputs.names(SignalType.LEVEL)
    assert "0x1008" in inputs.names(SignalType.TEXT)
    with pytest.raises(ValueError, match="no input 'x'; known: power_off"):
        inputs.find("x")
    for name, value in (("power_off", 2), ("power_off", "x"), ("emergency", -1)):
        with pytest.raises(ValueError, match=f"{name} .* is not in 0.."):
            inputs.set(name, value)
