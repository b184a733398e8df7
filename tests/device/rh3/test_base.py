from __future__ import annotations

from math import pi

import pytest

from tests.device.rh3.driven import M_S, Driven
from tickrig.device.rh3.driver import OUTPUTS
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, BaseParameters
from tickrig.wire.instant import NEVER
from tickrig.wire.modbus import Command, Fault, Mode, Status, encode_frame


def moving(left: float = 0.3, right: float = 0.3, **parameters: float) -> Driven:
    """Return a base that drives, with its watchdog off."""
    driven = Driven(BaseParameters(**parameters))  # type: ignore[arg-type]
    driven.write(watchdog_ms=0)
    driven.enable()
    driven.drive(left, right)
    driven.run(1_000)
    return driven


def test_it_says_what_it_is() -> None:
    driven = Driven()
    assert (driven.read("device_id"), driven.read("version")) == (0x5248, 0x0100)
    assert (driven.read("encoder_counts"), driven.read("watchdog_ms")) == (2_000, 500)


def test_it_drives_as_fast_as_it_is_told() -> None:
    driven = moving()
    assert driven.see("speed_m_s") == pytest.approx(0.3, rel=1e-3)
    assert driven.read("speed_left") == pytest.approx(0.3 * M_S, rel=2e-3)
    assert driven.read("status") == Status.ENABLED | Status.MOVING


def test_the_counters_count_the_way() -> None:
    driven = moving()
    driven.drive(0.0, 0.0)
    driven.run(1_000)
    way_m = driven.see("x_m")
    assert way_m > 0.25
    assert driven.read("position_left") == pytest.approx(way_m * M_S, abs=1)


def test_the_speed_answers_with_its_time_constant() -> None:
    driven = Driven()
    driven.enable()
    driven.write(target_speed_left=5_000)
    start_us = driven.now_us
    while driven.base.sides[0].wheel.speed < 5.0 * (1 - 0.3679):
        driven.run(1)
    assert (driven.now_us - start_us) / 1_000 == pytest.approx(50, abs=6)


def test_a_turn_on_the_spot_follows_the_tread() -> None:
    driven = moving(-0.1, 0.1)
    assert driven.see("turn_rad_s") == pytest.approx(0.2 / 0.464, rel=2e-3)
    assert abs(driven.see("x_m")) < 1e-3


def test_the_acceleration_is_limited() -> None:
    driven = Driven()
    driven.write(acceleration_limit=round(0.1 * M_S))
    driven.enable()
    driven.drive(0.3, 0.3)
    driven.run(500)
    assert driven.see("speed_m_s") == pytest.approx(0.05, abs=0.006)


def test_the_speed_is_limited_and_the_status_tells() -> None:
    driven = Driven()
    driven.write(speed_limit=round(0.2 * M_S), watchdog_ms=0)
    driven.enable()
    driven.drive(0.3, -0.3)
    driven.run(1_000)
    assert driven.read("speed_left") == pytest.approx(0.2 * M_S, rel=2e-3)
    assert driven.read("speed_right") == pytest.approx(-0.2 * M_S, rel=2e-3)
    assert driven.read("status") & Status.CLIPPED


def test_a_load_slows_it_down_and_the_integral_gain_mends_it() -> None:
    driven = moving(0.1, 0.1)
    driven.base.inputs.set("load_left_nm", 2.5)
    driven.run(1_000)
    droop = 0.1 * M_S - driven.read("speed_left")
    assert droop == pytest.approx(10_000, rel=0.05)  # 100 per mille at 10 for a count/ms
    assert driven.read("current_left") == pytest.approx(0.12 * 3_000, rel=0.05)
    driven.write(gain_vi=1)
    driven.run(2_000)
    assert driven.read("speed_left") == pytest.approx(0.1 * M_S, rel=5e-3)


@pytest.mark.unmeasured
def test_a_position_is_reached_and_held() -> None:
    driven = Driven()
    driven.write(watchdog_ms=0)
    driven.write(target_position_left=50_000, target_position_right=-20_000)
    driven.enable(Mode.POSITION)
    driven.run(4_000)
    assert driven.read("position_left") == pytest.approx(50_000, abs=1)
    assert driven.read("position_right") == pytest.approx(-20_000, abs=1)
    driven.run(20)
    assert driven.base.due_us == NEVER


def test_the_gains_of_the_position_loop_act() -> None:
    way = {}
    for gains in ((10, 0, 0), (20, 0, 0), (10, 30, 0), (10, 0, 5)):
        driven = Driven()
        driven.write(watchdog_ms=0)
        driven.write(**dict(zip(("gain_p", "gain_i", "gain_d"), gains, strict=True)))
        driven.write(target_position_left=5_000)
        driven.enable(Mode.POSITION)
        driven.run(100)
        way[gains] = driven.read("position_left")
    assert len(set(way.values())) == 4
    assert way[20, 0, 0] > way[10, 0, 0]


@pytest.mark.parametrize("command", [Command.STOP, Command.QUICK_STOP])
def test_it_stops_when_told_until_it_has_a_new_target(command: Command) -> None:
    driven = moving()
    driven.write(command=command)
    driven.run(1_000)
    assert driven.read("status") == Status.ENABLED
    assert driven.read("target_speed_left") == 0
    driven.drive(0.1, 0.1)
    driven.run(100)
    assert driven.read("status") == Status.ENABLED | Status.MOVING


def test_a_quick_stop_has_no_ramp() -> None:
    speeds = {}
    for command in (Command.STOP, Command.QUICK_STOP):
        driven = moving()
        driven.write(acceleration_limit=round(1.5 * M_S))
        driven.write(command=command)
        driven.run(100)
        speeds[command] = driven.base.sides[0].wheel.speed
    assert 0 < speeds[Command.QUICK_STOP] < speeds[Command.STOP] / 2


def test_without_power_it_rolls_to_a_stop() -> None:
    driven = moving()
    driven.write(command=Command.DISABLE)
    driven.run(500)
    assert 0 < driven.see("speed_m_s") < 0.3
    driven.run(3_000)
    assert driven.see("speed_m_s") == 0
    assert driven.base.due_us == NEVER


def test_mode_free_lets_it_roll_and_velocity_takes_it_over() -> None:
    driven = moving()
    driven.write(mode=Mode.FREE)
    driven.run(200)
    rolling = driven.base.sides[0].wheel.speed
    assert 0 < rolling < 0.3 * M_S / 1_000
    driven.write(mode=Mode.VELOCITY)
    assert driven.base.sides[0].wheel.speed == pytest.approx(rolling, rel=0.15)


def test_counters_are_zeroed_on_demand() -> None:
    driven = moving()
    driven.drive(0, 0)
    driven.run(1_000)
    driven.write(command=Command.ZERO_COUNTERS)
    assert (driven.read("position_left"), driven.read("position_right")) == (0, 0)


def test_a_side_that_runs_backward_counts_backward() -> None:
    driven = Driven()
    driven.write(direction=2)
    driven.enable()
    driven.drive(0.1, -0.1)
    driven.run(400)
    assert driven.see("speed_m_s") == pytest.approx(0.1, rel=0.02)
    assert driven.read("position_right") < 0 < driven.read("position_left")


def test_silence_stops_it_and_a_new_target_starts_it_again() -> None:
    driven = Driven()
    driven.enable()
    driven.drive(0.3, 0.3)
    driven.run(490)
    assert driven.base.sides[0].wheel.speed > 7
    driven.run(1_000)
    assert driven.see("speed_m_s") == 0
    assert driven.read("status") == Status.ENABLED | Status.WATCHDOG
    driven.drive(0.1, 0.1)
    driven.run(200)
    assert driven.read("status") == Status.ENABLED | Status.MOVING


def test_any_request_keeps_the_watchdog_quiet() -> None:
    driven = Driven()
    driven.enable()
    driven.drive(0.3, 0.3)
    for _ in range(10):
        driven.run(400)
        assert driven.read("status") == Status.ENABLED | Status.MOVING


@pytest.mark.parametrize(
    ("cause", "fault_left", "fault_right"),
    [
        ("emergency_stop", Fault.EMERGENCY_STOP, Fault.EMERGENCY_STOP),
        ("encoder_unplugged_left", Fault.ENCODER, 0),
        ("encoder_unplugged_right", 0, Fault.ENCODER),
        ("short_circuit_left", Fault.OVER_CURRENT, 0),
        ("jam_right", 0, Fault.STALL),
    ],
)
def test_a_fault_stops_both_wheels_and_stays_until_cleared(
    cause: str, fault_left: int, fault_right: int
) -> None:
    driven = moving(0.5, 0.5)
    driven.base.inputs.set(cause, 1)
    driven.run(1_200)
    assert (driven.read("fault_left"), driven.read("fault_right")) == (fault_left, fault_right)
    pressed = Status.EMERGENCY_STOP if cause == "emergency_stop" else 0
    assert driven.read("status") == Status.FAULT | pressed
    assert driven.see("speed_m_s") == 0
    driven.write(command=Command.ENABLE)
    assert not driven.read("status") & Status.ENABLED
    driven.base.inputs.set(cause, 0)
    driven.write(command=Command.CLEAR_FAULT)
    assert driven.read("status") == 0
    driven.write(command=Command.ENABLE)
    driven.run(100)
    assert driven.read("status") == Status.ENABLED | Status.MOVING


def test_a_fault_whose_cause_is_there_is_not_cleared() -> None:
    driven = Driven()
    driven.base.inputs.set("encoder_unplugged_left", 1)
    driven.run(1)
    driven.write(command=Command.CLEAR_FAULT)
    assert driven.read("fault_left") == Fault.ENCODER


def test_a_short_circuit_shows_when_the_motors_get_power() -> None:
    driven = Driven()
    driven.base.inputs.set("short_circuit_right", 1)
    driven.run(10)
    assert driven.read("fault_right") == 0
    driven.enable()
    assert driven.read("fault_right") == Fault.OVER_CURRENT
    assert not driven.read("status") & Status.ENABLED


def test_the_bumper_is_told_and_the_master_has_to_act() -> None:
    driven = moving()
    driven.base.inputs.set("bumper", 1)
    driven.run(100)
    assert driven.read("status") == Status.ENABLED | Status.MOVING | Status.BUMPER


def test_a_jam_does_not_stall_what_has_no_torque() -> None:
    driven = Driven()
    driven.base.inputs.set("jam_left", 1)
    driven.base.inputs.set("load_left_nm", 50.0)
    driven.run(1_000)
    assert driven.read("fault_left") == 0
    driven.run(20)
    assert driven.base.due_us == NEVER


def test_a_slope_moves_what_is_not_held() -> None:
    driven = Driven()
    driven.base.inputs.set("load_left_nm", -5.0)
    driven.run(300)
    assert driven.see("speed_m_s") > 0.1


def test_without_supply_it_brakes_forgets_and_is_silent() -> None:
    driven = moving()
    driven.write(gain_vp=20)
    driven.base.inputs.set("power_cut", 1)
    assert driven.ask(b"\x03\x00\x00\x00\x01") == ""
    driven.run(1_000)
    assert (driven.see("speed_m_s"), driven.see("status")) == (0, 0)
    assert driven.base.due_us == NEVER
    driven.base.inputs.set("power_cut", 0)
    assert (driven.read("gain_vp"), driven.read("position_left")) == (10, 0)
    assert driven.read("sample") < 20


def test_the_sample_counter_counts_milliseconds_and_wraps() -> None:
    driven = Driven(dense=False)
    first = driven.read("sample")
    driven.run(65_536 - 4)
    assert driven.read("sample") == first


def test_a_command_takes_effect_after_the_delay() -> None:
    quick, slow = Driven(), Driven(BaseParameters(delay_ms=100))
    for driven in (quick, slow):
        driven.enable()
        driven.drive(0.1, 0.1)
    slow.run(100)
    assert slow.base.sides[0].wheel.travel == quick.base.sides[0].wheel.travel > 0


def test_slip_parts_wheel_and_ground() -> None:
    driven = Driven(BaseParameters(friction=0.01))
    driven.enable()
    driven.drive(1.0, 1.0)
    driven.run(300)
    assert driven.see("slip_left_m_s") > 0.1
    assert driven.see("x_m") < driven.see("angle_left_rad") * 0.0995 / 2


def test_radius_and_tread_errors_bend_the_way() -> None:
    driven = moving(0.3, 0.3, radius_left_m=0.1)
    assert driven.see("heading_rad") < -1e-4


def test_the_ground_is_rough_by_its_seed() -> None:
    first, again, other = (moving(noise=0.1, seed=seed) for seed in (1, 1, 2))
    assert first.see("x_m") == again.see("x_m") != other.see("x_m")
    assert first.see("heading_rad") != 0


def test_it_may_be_put_elsewhere() -> None:
    driven = moving()
    driven.base.ground.pose = type(driven.base.ground.pose)(5.0, 1.0, pi / 2)
    driven.run(500)
    assert driven.see("x_m") == pytest.approx(5.0, abs=1e-6)
    assert driven.see("y_m") > 1.1


def test_reset_begins_as_after_power_up() -> None:
    driven = moving()
    driven.base.reset()
    driven.run(1)
    assert driven.read("mode") == Mode.FREE
    assert (driven.see("served"), driven.see("garbled")) == (1, 0)


def test_garbled_frames_and_frames_for_others_are_passed_over() -> None:
    driven = Driven()
    assert driven.run(5, b"\x01\x03\x00") == b""
    assert driven.run(5, bytes(300)) == b""
    assert driven.ask(b"\x03\x00\x00\x00\x01", address=2) == ""
    assert (driven.see("garbled"), driven.see("served")) == (2, 0)


def test_a_broadcast_is_obeyed_without_an_answer() -> None:
    driven = Driven()
    assert driven.run(5, encode_frame(0, b"\x06\x00\x10\x00\x01")) == b""
    assert driven.read("mode") == Mode.VELOCITY


@pytest.mark.parametrize(
    ("message", "answer"),
    [
        ("03 0002 0001", "8302"),  # nothing there
        ("03 0010 0004", "8302"),  # runs into a gap
        ("06 0000 0001", "8602"),  # read-only
        ("06 0100 0001", "8602"),  # half a number
        ("10 0101 0002 04 0000 0000", "9002"),  # from the middle of one
        ("06 0010 0003", "8603"),  # no such mode
        ("10 0026 0002 04 ffff ffff", "9003"),  # a negative limit
        ("17 0300 0001 0010 0001 02 0001", "9702"),  # nothing is written either
        ("2b 0e 01 00", "ab01"),
    ],
)
def test_what_cannot_be_is_refused(message: str, answer: str) -> None:
    driven = Driven()
    assert driven.ask(bytes.fromhex(message)).replace(" ", "") == answer
    assert driven.read("mode") == Mode.FREE


def test_one_request_writes_targets_and_reads_what_is_measured() -> None:
    driven = Driven()
    driven.enable()
    answer = driven.ask(bytes.fromhex("17 0200 000c 0100 0004 08 0000 1000 0000 1000"))
    assert answer.startswith("1718 0001")
    driven.run(300)
    assert driven.read("speed_left") == pytest.approx(0x1000, rel=0.02)


def test_it_is_a_device_of_a_millisecond_with_named_outputs() -> None:
    base = Driven().base
    assert (base.tick_us, set(base.outputs)) == (1_000, {output.name for output in OUTPUTS})
    with pytest.raises(KeyError):
        base.read("no such thing")


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("address", 0, "1..247"),
        ("tread_m", 0.0, "above 0"),
        ("noise", -1.0, "0..60000"),
        ("friction", -0.1, "0..10"),
    ],
)
def test_parameters_that_cannot_be_are_refused(name: str, value: float, allowed: str) -> None:
    with pytest.raises(ValueError, match=f"{name} .*{allowed}"):
        BaseParameters(**{name: value})  # type: ignore[arg-type]


def test_a_radian_of_the_wheel_has_the_counts_of_the_specification() -> None:
    assert pytest.approx(23_844.6, abs=0.1) == COUNTS_PER_RAD


def test_what_happened_to_it_is_due_at_once() -> None:
    driven = moving()
    assert driven.base.due_us > 0
    driven.base.inputs.set("bumper", 1)
    assert driven.base.due_us == 0


def test_milliseconds_that_nobody_ticked_are_made_up_for() -> None:
    ticked, left_alone = moving(), moving()
    ticked.run(50)
    left_alone.now_us += 49_000
    left_alone.run(1)
    assert left_alone.read("position_left") == ticked.read("position_left")
