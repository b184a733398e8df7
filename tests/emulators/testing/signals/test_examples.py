"""Three simulators in TOML, beside references that are computed without any signal."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from itertools import pairwise
from math import exp, floor
from pathlib import Path
from typing import Any

import pytest

from tests.emulators.testing.bench.test_recorded_device import replayed
from tests.emulators.testing.signals.signal_bench import signals_of
from tickrig import open_bench
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.eds import read_eds
from tickrig.emulators.canopen.node import Node, NodeSide
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.signals.driver import SignalDriver
from tickrig.wire.instant import NEVER

RIGS = Path(__file__).parents[4] / "examples/rigs"
NAMES = ("battery", "encoder", "temperatures")


def slave_of(device: dict[str, Any]) -> CanopenSlave:
    makers = {"epos": make_epos, "f-palette": make_f_palette}
    if device["type"] in makers:
        return makers[device["type"]](device["node_id"])
    made = read_eds(RIGS / device["type"]).make_dictionary()
    return make_slave(made, device["node_id"], application=Ds401)


class Example:
    """A rig file of `examples/rigs` with nodes and signals, on a rig."""

    def __init__(self, name: str) -> None:
        self.text = (RIGS / f"{name}.toml").read_text("utf-8")
        plan, wire = tomllib.loads(self.text), CanWire()
        nodes = {key: Node(key, slave_of(each), wire) for key, each in plan["device"].items()}
        self.devices = {key: NodeSide(node) for key, node in nodes.items()}
        driven = {
            f"{key}/{name}": value
            for key, each in plan["device"].items()
            for name, value in each["start"].items()
        }
        self.driver = SignalDriver(signals_of({**plan["signal"], **driven}, RIGS), self.devices)
        self.plan = plan
        self.watch = Watch(self.devices)
        self.rig = Rig(
            *(Station(node, node.port) for node in nodes.values()),
            couplings=[self.driver, self.watch],
        )

    def driven(self, device: str) -> list[str]:
        """Return which inputs of a device have signals."""
        return list(self.plan["device"][device]["start"])


class Watch:
    """Keeps what a device shows at each tick that is run."""

    tick_us, due_us = 1_000, NEVER

    def __init__(self, devices: dict[str, NodeSide]) -> None:
        self.devices, self.current_a = devices, [(0, 0.0)]

    def act(self, now_us: int, /) -> None:
        if "left" in self.devices:
            self.current_a.append((now_us, float(self.devices["left"].read("current_a"))))


@pytest.mark.parametrize("name", NAMES)
def test_it_needs_few_lines(name: str) -> None:
    text = Example(name).text
    assert len(text.splitlines()) <= 25


@pytest.mark.parametrize("name", NAMES)
def test_a_bench_does_the_same(name: str) -> None:
    example = Example(name)
    with open_bench(RIGS / f"{name}.toml") as bench:
        for _ in range(4):
            example.rig.run_for(700_000)
            bench.run_for("700ms")
            for key, device in example.devices.items():
                inputs = {one: device.inputs[one] for one in example.driven(key)}
                assert inputs == {one: bench[key].get(one) for one in inputs}


@pytest.mark.parametrize("name", NAMES)
def test_its_trace_replays_without_any_signal(name: str, tmp_path: Path) -> None:
    with open_bench(RIGS / f"{name}.toml") as bench:
        bench.run_for("2s")
        assert replayed(bench, tmp_path / "run.trace").startswith("identical: ")


def held(samples: list[tuple[int, float]], every_us: int, until_us: int) -> Iterator[float]:
    """Yield, for each time, the latest sample before it."""
    at = 0
    for time_us in range(0, until_us, every_us):
        while at + 1 < len(samples) and samples[at + 1][0] < time_us + every_us:
            at += 1
        yield samples[at][1]


def test_a_battery_gives_way_and_is_emptied() -> None:
    example = Example("battery")
    drive = example.devices["left"]
    assert drive.inputs["supply_v"] == 24.7
    for name, value in (("0x6060", 3), ("0x60FF", 2_000), ("0x6040", 6), ("0x6040", 7)):
        drive.inputs.set(name, value)
        example.rig.run_for(20_000)
    drive.inputs.set("load_nm", -1.0)
    drive.inputs.set("0x6040", 15)
    lowest = 99.0
    for _ in range(100):
        example.rig.run_for(30_000)
        lowest = min(lowest, float(drive.inputs["supply_v"]))
    assert lowest < 24.4  # while it speeds up
    used_ah = 2.0 + sum(
        (0.4 + abs(current_a)) * 0.01 / 3600
        for current_a in held(example.watch.current_a, 10_000, example.rig.now_us)
    )
    assert float(example.driver.value("used_ah")) == pytest.approx(used_ah, rel=1e-9)
    now_a = 0.4 + abs(float(drive.read("current_a")))
    rest_v = 25.4 - 0.3 * used_ah - 2.4 * exp(3 * (used_ah - 7))
    assert drive.inputs["supply_v"] == pytest.approx(rest_v - 0.25 * now_a, abs=0.006)


def turned(t_s: float) -> float:
    """Return the turns of the wheel: trapezia of its speed."""
    points = [(0, 0), (1, 60), (3, 60), (4, -30), (5.5, -30), (6, 0), (99, 0)]
    turns = 0.0
    for (begin_s, first), (end_s, last) in pairwise(points):
        if t_s > begin_s:
            way = (min(t_s, end_s) - begin_s) / (end_s - begin_s)
            turns += (min(t_s, end_s) - begin_s) * (first + first + (last - first) * way) / 2 / 60
    return turns


def test_an_encoder_counts_there_and_back() -> None:
    example = Example("encoder")
    board = example.devices["board"].inputs
    sequence = [(0, 0), (1, 0), (1, 1), (0, 1)]
    count, phase, most, indices, index = 0, 0, 0, 0, 1
    for _ in range(7_000):
        example.rig.run_for(1_000)
        now = sequence.index((int(board["di1"]), int(board["di2"])))
        change = (now - phase + 1) % 4 - 1
        assert change in (-1, 0, 1)  # no edge was lost
        count, phase = count + change, now
        most = max(most, count)
        indices, index = indices + (int(board["di3"]) > index), int(board["di3"])
        assert abs(count - floor(20 * turned(example.rig.now_us / 1e6))) <= 1
    assert most == floor(20 * turned(3 + 2 / 3)) == 56
    assert count == floor(20 * turned(7))
    assert indices == 3  # at 1 and 2 turns, and at 2 on the way back


def housing_of(air: list[tuple[float, float]], until_s: int) -> list[float]:
    """Return the temperature of the housing at each second: midpoint steps of 0.1 s."""

    def source(t_s: float) -> float:
        for (begin_s, first), (end_s, last) in pairwise(air):
            if begin_s <= t_s <= end_s:
                air_c = first + (last - first) * (t_s - begin_s) / (end_s - begin_s)
                break
        return air_c + (36 if t_s % 900 >= 450 else 0)

    housing, step, values = source(0), 0.1, []
    for number in range(until_s * 10):
        if number % 10 == 0:
            values.append(housing)
        half = housing + (source(number * step) - housing) / 240 * step / 2
        housing += (source((number + 0.5) * step) - half) / 240 * step
    return values


def test_temperatures_of_a_morning() -> None:
    example = Example("temperatures")
    air = [(0, 4.5), (1800, 4.1), (3600, 5.0), (5400, 8.2), (7200, 11.6)]
    wanted = housing_of([(float(t), c) for t, c in air], 2_400)
    left, palette = example.devices["left"].inputs, example.devices["palette"].inputs
    assert example.driver.value("housing_c") == 4.5
    for second in range(60, 2_400, 60):
        example.rig.run_to(second * 1_000_000)
        assert example.driver.value("housing_c") == pytest.approx(wanted[second], abs=0.15)
        kelvin = float(example.driver.value("housing_c")) + 273.15
        ratio = exp(3950 * (1 / kelvin - 1 / 298.15))
        assert palette["ai1_v"] == pytest.approx(5 * ratio / (1 + ratio), abs=0.0006)
    assert left["ambient_c"] == pytest.approx(4.1 + 0.9 * 540 / 1800, abs=1e-9)
