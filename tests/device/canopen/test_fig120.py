"""The acceptance checks of the demonstration of Fig. 120 (NEDO report, 3.4.43.3)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.device.canopen.fig120 import MEASURED, POTENTIOMETER, SETUP, Demo, look, make_motor
from tests.wire.candump_port import CandumpPort
from tickrig.device.canopen.slave import Application
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import parse_log

pytestmark = pytest.mark.unmeasured

ENCODER_DEG = 360 / 409_600
ADC_STEP_V = 5 / 4095


@pytest.fixture
def demo() -> Demo:
    """Both devices after the set-up, the master gone."""
    demo = Demo()
    demo.set_up()
    demo.wire.disconnect(demo.master)
    return demo


def test_the_set_up_goes_frame_by_frame_as_the_vector_says() -> None:
    demo = Demo()
    demo.set_up()
    told = demo.told
    assert told[:-2] == list(SETUP[:-2])
    assert sorted(told[-2:]) == sorted(SETUP[-2:])  # heartbeats, each at its own time


def test_the_motor_follows_when_the_master_is_gone(demo: Demo) -> None:
    for row in POTENTIOMETER:
        demo.turn(row["volt"])
        demo.run_ms(1_500)
        pdo = row["tpdo2_290"].replace(" ", "")
        assert [text for _, text in demo.heard if text.startswith("290#")][-1] == f"290#{pdo}"
        seen = look(demo.now_us, demo.motor)
        assert round(seen.target_deg, 4) == row["angle_deg"]
        assert seen.angle_deg == pytest.approx(row["angle_deg"], abs=2 * ENCODER_DEG)


@pytest.mark.parametrize("wait_ms", [315, 411, 533])
def test_a_step_reaches_the_motor_in_two_ticks_and_its_end_in_035_s(
    demo: Demo, wait_ms: int
) -> None:
    demo.run_ms(wait_ms)
    tick_us = demo.turn(2.5)
    seen = demo.watch_ms(700)
    sent_us = min(at for at, text in demo.heard if text == "290#0040")
    assert tick_us <= sent_us < tick_us + 1_000  # it leaves in the tick and takes some 100 us
    received_us = sent_us // 1_000 * 1_000 + 1_000
    assert [round(s.target_deg, 4) for s in seen if s.at_us == received_us] == [90.0027]
    assert [s.target_deg for s in seen if s.at_us < received_us] == [0.0]
    reached_us = min(s.at_us for s in seen if abs(s.angle_deg - 90.0027) < 0.01)
    assert reached_us - received_us == pytest.approx(350_000, abs=10_000)


def test_the_unit_says_that_it_has_reached_the_target(demo: Demo) -> None:
    demo.run_ms(500)
    demo.turn(2.5)
    demo.run_ms(1)
    statuses = []
    for _ in range(50):
        demo.run_ms(10)
        statuses.append(demo.slave.dictionary[0x2001, 0].number)
    assert statuses.index(3) == 36


def test_a_wobble_of_one_step_is_told_by_the_event_timer_alone(demo: Demo) -> None:
    demo.turn(2.5)
    demo.run_ms(1_000)
    (last_us,) = demo.times_us("290#", demo.now_us - 50_000)[-1:]
    demo.run_ms((last_us // 1_000 + 10) - demo.now_us // 1_000 + 50)
    begin_us = demo.now_us
    for steps in (1, 0, -1, 0) * 25:
        demo.turn(2.5 + steps * ADC_STEP_V)
        demo.run_ms(5)
    times_us = demo.times_us("290#", begin_us)
    assert len(times_us) == 10
    assert {b - a for a, b in pairwise(times_us)} <= {49_999, 50_000, 50_001}


def test_a_change_of_two_steps_is_told_at_once(demo: Demo) -> None:
    demo.turn(2.5)
    demo.run_ms(1_000)
    (last_us,) = demo.times_us("290#", demo.now_us - 50_000)[-1:]
    demo.run_ms((last_us // 1_000 + 70) - demo.now_us // 1_000)
    tick_us = demo.turn(2.5 + 2 * ADC_STEP_V)
    demo.run_ms(2)
    assert [text for at_us, text in demo.heard if at_us > tick_us] == ["290#1040"]


def test_changes_are_told_no_faster_than_the_inhibit_time(demo: Demo) -> None:
    demo.run_ms(500)
    begin_us = demo.now_us
    for number in range(100):
        demo.turn(number * 0.05)
        demo.run_ms(1)
    times_us = demo.times_us("290#", begin_us)
    assert len(times_us) == 10
    assert min(b - a for a, b in pairwise(times_us)) > 9_990


def test_a_motor_holds_its_last_reference_when_the_palette_is_stopped(demo: Demo) -> None:
    demo.turn(2.5)
    demo.run_ms(1_000)
    demo.wire.reconnect(demo.master)
    demo.say("000#0210")
    demo.run_ms(2)
    begin_us = demo.now_us
    demo.turn(5.0)
    demo.run_ms(1_000)
    assert demo.times_us("290#", begin_us) == []
    seen = look(demo.now_us, demo.motor)
    assert round(seen.target_deg, 4) == 90.0027
    assert seen.angle_deg == pytest.approx(90.0027, abs=2 * ENCODER_DEG)


def turn_it(demo: Demo) -> list[float]:
    """Play the whole demonstration, and return the curve of the shaft, ms by ms."""
    curve = [seen.angle_deg for seen in demo.watch_ms(demo.now_us // 1_000)]
    for volts in (0.3, 2.5, 5.0, 1.25):
        demo.turn(volts)
        curve += [seen.angle_deg for seen in demo.watch_ms(450)]
    return curve


def test_a_log_of_the_bus_moves_another_motor_in_the_same_way(demo: Demo) -> None:
    begin_us = demo.now_us // 1_000 * 1_000
    curve = turn_it(demo)
    text = "".join(f"{line}\n" for line in demo.lines)
    slave = make_motor()
    port = CandumpPort(parse_log(text), lambda frame: frame.can_id not in (MEASURED, 0x5A0, 0x720))
    rig, motor = Rig(Station(slave, port)), Application.of(slave)
    replayed: list[float] = []
    rig.run_to(begin_us)
    while len(replayed) < len(curve):
        rig.run_to(rig.now_us + 1_000)
        replayed.append(look(rig.now_us, motor).angle_deg)
    assert max(curve) > 179
    assert replayed == curve


def test_dense_and_sparse_runs_of_the_demonstration_are_the_same() -> None:
    def play(*, dense: bool) -> tuple[list[float], list[str]]:
        demo = Demo(dense=dense)
        demo.set_up()
        return turn_it(demo), demo.log.lines

    assert play(dense=False) == play(dense=True)
