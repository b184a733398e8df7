"""A positioning drive by CiA 402: states, moves, faults, and what must stop it."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest

from tests.hil.node import PATIENCE, NodeUnderTest
from tests.hil.rigs import RIGS
from tickrig import Bench

pytestmark = pytest.mark.needs("device:epos")

ENABLED, QUICK_STOP, FAULT, NOT_READY = 0x27, 0x07, 0x08, 0x40
STATE_MASK = 0x6F
TARGET_REACHED = 0x0400
HIGH_SPEED = 5_000


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "epos.toml"


@pytest.fixture
def drive(bench: Bench) -> NodeUnderTest:
    drive = NodeUnderTest(bench, 1)
    drive.start()
    return drive


def state(drive: NodeUnderTest) -> int:
    return drive.read(0x6041) & STATE_MASK


def enable(drive: NodeUnderTest, mode: int) -> None:
    drive.write(0x6060, mode, 1)
    for controlword in (0x80, 0x06, 0x07, 0x0F):
        drive.write(0x6040, controlword, 2)
    assert drive.bench.wait_until(lambda: state(drive) == ENABLED, within=PATIENCE)


def turn(drive: NodeUnderTest, velocity_rpm: int) -> None:
    """Turn the motor in profile velocity mode."""
    enable(drive, 3)
    drive.write(0x60FF, velocity_rpm, 4)
    drive.write(0x6040, 0x0F, 2)
    assert drive.bench.wait_until(lambda: abs(velocity(drive) - velocity_rpm) < 50, within=PATIENCE)


def velocity(drive: NodeUnderTest) -> int:
    return drive.read(0x606C, signed=True)


def stands(drive: NodeUnderTest) -> bool:
    return drive.bench.wait_until(lambda: abs(velocity(drive)) < 5, within="5s")


def test_it_says_what_it_is(drive: NodeUnderTest) -> None:
    assert drive.read(0x1000) == 0x0002_0192
    assert drive.read(0x6502) & 0b101  # profile position and profile velocity


def test_it_is_led_through_its_states(drive: NodeUnderTest) -> None:
    assert state(drive) == NOT_READY
    enable(drive, 1)
    drive.write(0x6040, 0x00, 2)
    assert drive.bench.wait_until(lambda: state(drive) == NOT_READY, within=PATIENCE)


def test_it_moves_to_a_position(drive: NodeUnderTest) -> None:
    enable(drive, 1)
    begin = drive.read(0x6064, signed=True)
    drive.write(0x607A, begin + 20_000, 4)
    drive.write(0x6040, 0x1F, 2)
    assert drive.bench.wait_until(
        lambda: (
            bool(drive.read(0x6041) & TARGET_REACHED)
            and abs(drive.read(0x6064, signed=True) - begin - 20_000) < 20
        ),
        within="10s",
    )


def test_it_turns_at_a_velocity(drive: NodeUnderTest) -> None:
    turn(drive, 1_000)
    turn(drive, -500)


def test_a_quick_stop_stops_it(drive: NodeUnderTest) -> None:
    turn(drive, 2_000)
    drive.write(0x6040, 0x0B, 2)
    assert stands(drive)
    assert drive.bench.wait_until(lambda: state(drive) == NOT_READY, within=PATIENCE)


def test_disable_voltage_lets_it_run_out(drive: NodeUnderTest) -> None:
    turn(drive, 2_000)
    drive.write(0x6040, 0x00, 2)
    assert stands(drive)


@pytest.mark.needs("fault:encoder_unplugged")
def test_a_pulled_encoder_is_a_fault_until_it_is_reset(drive: NodeUnderTest) -> None:
    turn(drive, 1_000)
    drive.bench.fault("encoder_unplugged")
    assert drive.bench.wait_until(lambda: state(drive) == FAULT, within=PATIENCE)
    drive.bench.clear("encoder_unplugged")
    assert drive.bench.wait_until(lambda: bool(drive.emergencies), within=PATIENCE)
    assert drive.read(0x1001) & 1
    enable(drive, 1)
    assert drive.read(0x1001) == 0


@pytest.mark.needs("input:supply_v")
def test_too_low_a_supply_is_a_fault(drive: NodeUnderTest) -> None:
    enable(drive, 1)
    drive.bench.set("supply_v", 8.0)
    assert drive.bench.wait_until(lambda: state(drive) == FAULT, within=PATIENCE)
    assert drive.bench.wait_until(lambda: 0x3220 in drive.emergencies, within=PATIENCE)


@pytest.mark.needs("fault:power_off")
def test_a_power_cut_stops_it_and_it_boots_again(drive: NodeUnderTest) -> None:
    turn(drive, 1_000)
    boots = drive.boots
    drive.bench.fault("power_off", for_="200ms")
    drive.bench.run_for("100ms")
    with pytest.raises(canopen.SdoCommunicationError):
        drive.read(0x6041)
    assert drive.bench.wait_until(lambda: drive.boots > boots, within="5s")
    assert state(drive) == NOT_READY


def test_nmt_stop_stops_it(drive: NodeUnderTest) -> None:
    drive.write(0x6007, 2, 2)  # abort connection: disable voltage
    turn(drive, 1_000)
    drive.node.nmt.state = "STOPPED"
    drive.bench.run_for("50ms")
    with pytest.raises(canopen.SdoCommunicationError):
        drive.read(0x6041)
    drive.start()
    assert stands(drive)


def test_a_lost_master_stops_it(drive: NodeUnderTest) -> None:
    drive.write(0x6007, 2, 2)
    master = 127
    drive.network.send_message(0x700 + master, b"\x05")
    drive.write(0x1016, (master << 16) | 200, 4, sub=1)
    drive.network.send_message(0x700 + master, b"\x05")
    turn(drive, 1_000)
    assert drive.bench.wait_until(lambda: 0x8130 in drive.emergencies, within="5s")
    assert stands(drive)


def test_pdos_carry_what_sdos_do(drive: NodeUnderTest) -> None:
    enable(drive, 3)
    seen: list[bytes] = []
    drive.network.subscribe(0x181, lambda can_id, data, stamp: seen.append(bytes(data)))
    drive.network.send_message(0x201, bytes.fromhex("0F00 F4010000"))
    assert drive.bench.wait_until(lambda: velocity(drive) > 450, within=PATIENCE)
    assert seen
    assert int.from_bytes(seen[-1][:2], "little") & STATE_MASK == ENABLED


def test_a_velocity_beyond_what_it_can_is_kept_to_the_limit(drive: NodeUnderTest) -> None:
    drive.write(0x607F, 1_200, 4)
    enable(drive, 3)
    drive.write(0x60FF, HIGH_SPEED, 4)
    drive.bench.run_for("1s")
    assert velocity(drive) <= 1_250
