"""Physical causes, what the drive makes of them, and the way back."""

from __future__ import annotations

import pytest

from tests.device.canopen.ds402.wheel import Wheel
from tickrig.device.canopen.ds402.automaton import Bounds
from tickrig.device.canopen.ds402.settings import register_of
from tickrig.wire.canopen.drive import DriveState

FAULT = DriveState.FAULT
SOD = DriveState.SWITCH_ON_DISABLED
ENABLED = DriveState.OPERATION_ENABLED


@pytest.fixture
def wheel() -> Wheel:
    return Wheel()


def turning(wheel: Wheel) -> Wheel:
    wheel.write(0x60FF, 600)
    wheel.enable(3)
    wheel.run(200)
    return wheel


def recovers(wheel: Wheel) -> bool:
    """Reset the fault and enable again; say whether that worked."""
    wheel.control(0x00, 0x80)
    if wheel.drive.state is FAULT:
        return False
    wheel.control(0x06, 0x07, 0x0F)
    wheel.run(100)
    return wheel.drive.enabled and wheel.read(0x603F) == 0


@pytest.mark.parametrize(
    ("cause", "value", "sound", "emcy", "lasts"),
    [
        ("short_circuit", 1, 0, "081#1023030000000000", False),
        ("supply_v", 8.0, 24.0, "081#2032050000000000", True),
        ("supply_v", 31.0, 24.0, "081#1032050000000000", True),
        ("encoder_unplugged", 1, 0, "081#2073210000000000", True),
    ],
)
def test_a_fault_of_the_electronics_switches_off_and_is_told(  # noqa: PLR0913, PLR0917 - a table
    wheel: Wheel, cause: str, value: float, sound: float, emcy: str, lasts: bool
) -> None:
    turning(wheel).set(**{cause: value})
    assert emcy in wheel.run(2)
    assert wheel.drive.state is FAULT
    assert wheel.read(0x603F) == int(emcy[6:8] + emcy[4:6], 16)
    wheel.run(5)
    wheel.control(0x80)
    assert (wheel.drive.state is FAULT) is lasts  # a short circuit is not seen without power
    wheel.set(**{cause: sound})
    assert recovers(wheel)


def test_a_short_circuit_that_is_still_there_is_found_again(wheel: Wheel) -> None:
    turning(wheel).set(short_circuit=1)
    wheel.run(2)
    wheel.control(0x80, 0x06, 0x07, 0x0F)
    wheel.run(2)
    assert wheel.drive.state is FAULT


def test_the_latest_error_code_is_seen_until_it_is_reset(wheel: Wheel) -> None:
    assert wheel.drive.read("error_code") == 0
    turning(wheel).set(encoder_unplugged=1)
    wheel.run(2)
    assert wheel.drive.read("error_code") == wheel.read(0x603F) != 0
    wheel.set(encoder_unplugged=0)
    assert recovers(wheel)
    assert wheel.drive.read("error_code") == 0


def test_without_power_the_drive_is_in_no_operation(wheel: Wheel) -> None:
    turning(wheel)
    assert wheel.drive.read("drive_state") == "Operation enabled"
    wheel.drive.without_power(1_000_000)
    assert wheel.drive.read("drive_state") == "Not ready to switch on"


def test_a_blocked_wheel_is_found_after_a_second_by_its_current(wheel: Wheel) -> None:
    turning(wheel).set(shaft_blocked=1)
    ended_ms = wheel.run_until(lambda: wheel.drive.state is FAULT, 2_000)
    assert 1_000 <= ended_ms < 1_200
    assert wheel.read(0x603F) == 0x7121
    wheel.set(shaft_blocked=0)
    assert recovers(wheel)


@pytest.mark.unmeasured
def test_a_broken_motor_wire_is_found_because_no_current_flows(wheel: Wheel) -> None:
    turning(wheel).set(motor_phase_open=1)
    wheel.run_until(lambda: wheel.drive.state is FAULT, 5_000)
    assert wheel.read(0x603F) == 0x7122
    wheel.set(motor_phase_open=0)
    assert recovers(wheel)


def test_a_blocked_wheel_loses_its_position_reference(wheel: Wheel) -> None:
    wheel.enable(1)
    wheel.set(shaft_blocked=1)
    wheel.write(0x607A, 20_000)
    wheel.write(0x6040, 0x1F)
    sent = list[str]()
    while wheel.drive.state is not FAULT:
        sent += wheel.step()
    sent += wheel.run(2)
    assert "081#1186210000000000" in sent
    wheel.set(shaft_blocked=0)
    assert recovers(wheel)


def test_the_following_error_may_be_large_for_its_time_out(wheel: Wheel) -> None:
    wheel.write(0x6065, 10)
    wheel.write(0x6066, 100)
    wheel.enable(8)
    wheel.set(shaft_blocked=1)
    wheel.write(0x607A, 50)
    wheel.run(20)
    assert wheel.read(0x6041) & 0x2000
    assert wheel.read(0x60F4) == 50
    assert wheel.run_until(lambda: wheel.drive.state is FAULT) in range(70, 100)


def test_a_hot_winding_warns_and_then_switches_off(wheel: Wheel) -> None:
    wheel.drive.supervision.bounds = Bounds(winding_dc=262, winding_warning_dc=256)
    wheel.write(0x60FF, 300)
    wheel.enable(3)
    wheel.set(load_nm=-4.0)
    wheel.run_until(lambda: bool(wheel.read(0x6041) & 0x0080))
    assert wheel.drive.enabled
    wheel.run_until(lambda: wheel.drive.state is FAULT)
    assert wheel.read(0x603F) == 0x4310
    wheel.control(0x80)
    assert wheel.drive.state is FAULT
    wheel.set(load_nm=0.0)
    wheel.run(20_000)
    assert recovers(wheel)


@pytest.mark.unmeasured
def test_a_cooling_winding_is_looked_at_each_second(wheel: Wheel) -> None:
    wheel.write(0x60FF, 300)
    wheel.enable(3)
    wheel.set(load_nm=-4.0)
    wheel.run(2_000)
    wheel.set(load_nm=0.0)
    wheel.control(0x00)
    wheel.run(500)
    before, due_us = wheel.drive.axis.motor.winding_dc, wheel.slave.due_us
    assert 0 < due_us - wheel.now_us <= 1_000_000
    wheel.run(1_500)
    assert wheel.drive.axis.motor.winding_dc < before
    assert wheel.drive.read("winding_c") == wheel.drive.axis.motor.winding_dc / 10


def test_a_lost_heartbeat_ends_in_fault_until_it_is_back(wheel: Wheel) -> None:
    wheel.write(0x1016, 0x007F_0064, sub=1)  # node 127 within 100 ms
    turning(wheel)
    wheel.step("77F#05")
    sent = wheel.run(120)
    assert "081#3081117F00000000" in sent
    wheel.run(200)
    assert (wheel.drive.state, wheel.read(0x603F)) == (FAULT, 0x8130)
    wheel.control(0x80)
    assert wheel.drive.state is FAULT
    wheel.step("77F#05")
    wheel.control(0x00, 0x80)
    assert wheel.drive.state is SOD


def test_a_second_fault_is_told_too_and_both_go_with_the_reset(wheel: Wheel) -> None:
    turning(wheel).set(short_circuit=1)
    wheel.run(2)
    wheel.set(short_circuit=0, supply_v=8.0)
    assert "081#2032070000000000" in wheel.run(2)
    wheel.set(supply_v=24.0)
    wheel.step()
    wheel.write(0x6040, 0x80)
    assert wheel.step()[-2:] == ["081#0000050000000000", "081#0000000000000000"]
    assert wheel.drive.state is SOD


def test_a_limit_switch_is_a_fault_when_the_wheel_runs_into_it(wheel: Wheel) -> None:
    turning(wheel).set(positive_limit_switch=1)
    wheel.run_until(lambda: wheel.drive.state is FAULT)
    assert (wheel.read(0x603F), wheel.read(0x60FD)) == (0xFF07, 0x02)
    wheel.write(0x60FF, -600)
    assert recovers(wheel)
    assert wheel.read(0x606C) == pytest.approx(-600, abs=5)
    wheel.set(positive_limit_switch=0, negative_limit_switch=1)
    wheel.run_until(lambda: wheel.drive.state is FAULT)
    assert wheel.read(0x603F) == 0xFF06


def test_a_software_limit_stops_in_time_and_is_a_fault(wheel: Wheel) -> None:
    wheel.write(0x607D, -20_000, sub=1)
    wheel.write(0x607D, 20_000, sub=2)
    wheel.write(0x60FF, 3_000)
    wheel.enable(3)
    wheel.run_until(lambda: wheel.drive.state is FAULT)
    assert wheel.read(0x603F) == 0xFF09
    assert 19_700 < wheel.read(0x6064) <= 20_050


def test_a_switch_may_be_pressed_by_the_shaft(wheel: Wheel) -> None:
    wheel.set(positive_limit_at=30.0, home_from=10.0, home_to=20.0, negative_limit_at=-5.0)
    turning(wheel)
    seen = set()
    while wheel.drive.enabled:
        wheel.step()
        seen.add(wheel.read(0x60FD))
    assert seen >= {0x00, 0x04, 0x02}
    assert wheel.drive.read("shaft_deg") == pytest.approx(30.0, abs=1.5)


@pytest.mark.parametrize(
    ("code", "register"),
    [
        *((0x2310, 0x02), (0x3220, 0x04), (0x4310, 0x08), (0x8130, 0x10)),
        *((0x7121, 0x20), (0x8611, 0x20), (0xFF06, 0x20)),
    ],
)
def test_an_error_code_has_its_bit_in_the_error_register(code: int, register: int) -> None:
    assert register_of(code) == register
