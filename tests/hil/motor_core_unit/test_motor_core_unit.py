"""A motor core unit: angle, velocity, current, and what must stop it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hil.node import PATIENCE, NodeUnderTest
from tests.hil.rigs import RIGS
from tickrig import Bench

pytestmark = pytest.mark.needs("device:motor_core_unit")

NODE_ID = 32
FREE, CURRENT, VELOCITY, ANGLE = range(4)
FULL_DEG, FULL_DEG_S = 180.0, 360.0
ON, REACHED, LIMITED, FAULT = 1, 2, 4, 8


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "motor_core_unit.toml"


@pytest.fixture
def unit(bench: Bench) -> NodeUnderTest:
    unit = NodeUnderTest(bench, NODE_ID)
    unit.start()
    return unit


def drive(unit: NodeUnderTest, mode: int, reference: float, full: float) -> None:
    unit.write(0x6411, round(reference / full * 32_767), 2, sub=1)
    unit.write(0x2000, mode, 1)


def angle_deg(unit: NodeUnderTest) -> float:
    return unit.read(0x6401, 1, signed=True) / 32_767 * FULL_DEG


def velocity_deg_s(unit: NodeUnderTest) -> float:
    return unit.read(0x6401, 2, signed=True) / 32_767 * FULL_DEG_S


def test_it_says_what_it_is(unit: NodeUnderTest) -> None:
    assert unit.read(0x1000) == 0x000C_0191


def test_an_angle_is_reached(unit: NodeUnderTest) -> None:
    drive(unit, ANGLE, 90.0, FULL_DEG)
    assert unit.bench.wait_until(
        lambda: bool(unit.read(0x2001) & REACHED) and abs(angle_deg(unit) - 90) < 0.1, within="5s"
    )


def test_it_turns_at_a_velocity_and_stops(unit: NodeUnderTest) -> None:
    drive(unit, VELOCITY, 120.0, FULL_DEG_S)
    assert unit.bench.wait_until(lambda: abs(velocity_deg_s(unit) - 120) < 5, within=PATIENCE)
    drive(unit, VELOCITY, 0.0, FULL_DEG_S)
    assert unit.bench.wait_until(lambda: abs(velocity_deg_s(unit)) < 1, within=PATIENCE)


def test_a_pdo_gives_the_reference(unit: NodeUnderTest) -> None:
    unit.write(0x2000, VELOCITY, 1)
    speed = round(60 / FULL_DEG_S * 32_767).to_bytes(2, "little")
    unit.network.send_message(0x300 + NODE_ID, speed + bytes(6))
    assert unit.bench.wait_until(lambda: abs(velocity_deg_s(unit) - 60) < 5, within=PATIENCE)


def test_leaving_operational_brakes_it(unit: NodeUnderTest) -> None:
    drive(unit, VELOCITY, 200.0, FULL_DEG_S)
    assert unit.bench.wait_until(lambda: velocity_deg_s(unit) > 150, within=PATIENCE)
    unit.node.nmt.state = "PRE-OPERATIONAL"
    assert unit.bench.wait_until(lambda: abs(velocity_deg_s(unit)) < 1, within=PATIENCE)


def test_an_unknown_mode_is_refused(unit: NodeUnderTest) -> None:
    with pytest.raises(Exception, match="0x06090031"):
        unit.write(0x2000, 4, 1)


@pytest.mark.needs("fault:encoder_unplugged")
def test_a_pulled_encoder_takes_its_power_off(unit: NodeUnderTest) -> None:
    drive(unit, VELOCITY, 100.0, FULL_DEG_S)
    unit.bench.run_for("500ms")
    unit.bench.fault("encoder_unplugged", for_="500ms")
    assert unit.bench.wait_until(lambda: bool(unit.read(0x2001) & FAULT), within=PATIENCE)
    assert unit.bench.wait_until(lambda: bool(unit.emergencies), within=PATIENCE)
    unit.bench.run_for("1s")
    unit.write(0x2000, FREE, 1)
    assert unit.bench.wait_until(lambda: not unit.read(0x2001) & FAULT, within=PATIENCE)


@pytest.mark.needs("fault:shaft_blocked")
def test_a_blocked_shaft_is_pressed_at_no_longer_than_it_can(unit: NodeUnderTest) -> None:
    unit.bench.fault("shaft_blocked")
    drive(unit, ANGLE, 90.0, FULL_DEG)
    assert unit.bench.wait_until(lambda: bool(unit.read(0x2001) & (LIMITED | FAULT)), within="10s")
    assert unit.bench.wait_until(lambda: bool(unit.read(0x2001) & FAULT), within="20s")


@pytest.mark.needs("fault:power_off")
def test_it_knows_its_angle_after_a_power_cut(unit: NodeUnderTest) -> None:
    drive(unit, ANGLE, 45.0, FULL_DEG)
    assert unit.bench.wait_until(lambda: abs(angle_deg(unit) - 45) < 0.1, within="5s")
    boots = unit.boots
    unit.bench.fault("power_off", for_="200ms")
    assert unit.bench.wait_until(lambda: unit.boots > boots, within="5s")
    unit.start()
    assert abs(angle_deg(unit) - 45) < 1
