"""Buttons, buzzer, watchdog, stablemode and status: the rules between the vectors."""

from __future__ import annotations

import pytest

from tests.device.rrc.bench import RrcBench
from tickrig.device.rrc.machine import ReceiveBuffer
from tickrig.wire.rrc.message import check_digit


def sounds(bench: RrcBench, ticks: int) -> str:
    """Return one character a tick: # while the buzzer sounds."""
    heard = ""
    for _ in range(ticks):
        bench.step()
        heard += "#" if bench.rrc.read("buzzer") else "."
    return heard


def out(bench: RrcBench) -> tuple[int | str, int | str]:
    return bench.rrc.read("out_v_pct"), bench.rrc.read("out_w_pct")


def test_a_beep_begins_in_the_tick_after_its_command() -> None:
    bench = RrcBench().power_on()
    bench.step("beep02010300000000000200")
    assert bench.rrc.read("buzzer") == 0
    assert sounds(bench, 10) == "##.#####.."  # a zero time skips its phase


def test_a_new_beep_replaces_the_one_that_plays() -> None:
    bench = RrcBench().power_on()
    bench.step("beepff000000000000000000")
    assert sounds(bench, 2) == "##"
    bench.step("beep01000000000000000000")
    assert bench.rrc.read("buzzer") == 0
    assert sounds(bench, 3) == "#.."


@pytest.mark.parametrize("line", ["beep00000000000000000000", "beep6464", "beepxx"])
def test_silence_and_a_wrong_beep_stop_the_sound_at_once(line: str) -> None:
    bench = RrcBench().power_on()
    bench.step("beepff000000000000000000")
    assert sounds(bench, 2) == "##"
    bench.step(line)
    assert bench.rrc.read("buzzer") == 0


def test_a_beep_with_a_wrong_check_stops_the_sound_and_another_line_does_not() -> None:
    bench = RrcBench().power_on()
    bench.step("beepff000000000000000000")
    bench.step("stablemode1")
    assert bench.step("statusA1F") == ["ER:CommandChecksum"]
    assert bench.rrc.read("buzzer") == 1
    assert bench.step("beep00000000000000000000F") == ["ER:CommandChecksum"]
    assert bench.rrc.read("buzzer") == 0


def test_gear_r_sounds_half_a_second_on_and_off() -> None:
    bench = RrcBench().enter("Limit")
    bench.step("joystick00006464002051e2d")
    bench.set(stick_v_pct=-50)
    assert sounds(bench, 151) == "#" * 50 + "." * 50 + "#" * 50 + "."


def test_a_beep_of_the_host_comes_before_the_alarm() -> None:
    bench = RrcBench().enter("Limit")
    bench.step("joystick00006464002051e2d")
    bench.set(stick_v_pct=-50)
    bench.step("beep000a0000000000000000")  # ten ticks of silence
    assert sounds(bench, 12) == "." * 10 + "##"


@pytest.mark.parametrize(
    ("held", "out_pct"),
    [
        ((), (-60, 20)),
        (("speed_down_button",), (0, 20)),
        (("speed_up_button",), (-60, 20)),
        (("speed_down_button", "speed_up_button"), (-60, -20)),
    ],
)
def test_held_buttons_and_alarm_choose_the_drive(
    held: tuple[str, ...], out_pct: tuple[int, int]
) -> None:
    bench = RrcBench().power_on()
    bench.set(stick_v_pct=-60, stick_w_pct=20, **dict.fromkeys(held, 1))
    bench.step()
    assert out(bench) == (0, 0)
    bench.tap("alarm_button")
    assert out(bench) == out_pct
    assert bench.state == "Standby"


def test_the_buttons_drive_is_gone_after_vr2_was_off() -> None:
    bench = RrcBench().power_on()
    bench.tap("alarm_button")
    bench.tap("power_button")
    bench.run(60)
    bench.power_on()
    bench.set(stick_v_pct=100)
    bench.step()
    assert out(bench) == (0, 0)


@pytest.mark.parametrize(("again", "gear"), [("speed_up_button", "R"), ("speed_down_button", "N")])
def test_a_second_press_of_alarm_begins_anew_only_with_another_choice(
    again: str, gear: str
) -> None:
    bench = RrcBench().power_on()
    bench.set(speed_up_button=1, stick_v_pct=-50)
    bench.tap("alarm_button")
    assert bench.rrc.read("gear") == "R"
    bench.set(speed_up_button=0, stick_v_pct=50)
    bench.set(**{again: 1})
    bench.tap("alarm_button")
    assert bench.rrc.read("gear") == gear


def test_alarm_in_limit_mode_does_not_change_the_drive() -> None:
    bench = RrcBench().enter("Limit")
    bench.set(stick_v_pct=-60, speed_down_button=1)
    bench.tap("alarm_button")
    assert out(bench) == (-60, 0)


def test_speed_buttons_step_the_mode_from_1_to_5() -> None:
    bench = RrcBench().power_on()
    for mode in (2, 3, 4, 5, 5):
        bench.tap("speed_up_button")
        assert bench.rrc.read("speed_mode") == mode
    for mode in (4, 3, 2, 1, 1):
        bench.tap("speed_down_button")
        assert bench.rrc.read("speed_mode") == mode


def test_the_lock_stops_the_buttons_but_not_their_counters() -> None:
    bench = RrcBench().power_on()
    bench.step("speedmode31")
    bench.step("statusA1")
    bench.set(speed_up_button=1)
    assert bench.step() == ["SA:00000000A31003"]
    bench.set(speed_up_button=0)
    assert bench.step() == ["SA:00000000A32004"]


def test_a_counter_goes_from_15_to_0() -> None:
    bench = RrcBench().power_on()
    bench.step("statusA1")
    for _ in range(7):
        bench.tap("alarm_button")
    bench.set(alarm_button=1)
    assert bench.step()[0][13:16] == "00F"
    bench.set(alarm_button=0)
    assert bench.step()[0][13:16] == "000"


def test_the_watchdog_runs_only_while_vr2_does() -> None:
    bench = RrcBench().boot()
    bench.align()
    bench.step("watchdog05")
    assert bench.run(1_000) == []
    bench.power_on()
    assert "EV:PowerOffWaitByWatchdog" in bench.run(10)


def test_entering_standby_renews_the_watchdog() -> None:
    bench = RrcBench().boot()
    bench.align()
    bench.step("watchdog05")
    bench.set(power_button=1)
    bench.run(31)
    assert bench.state == "Standby"
    assert bench.run(4) == []
    assert bench.step() == ["EV:PowerOffWaitByWatchdog"]


def test_a_wrong_check_does_not_renew_the_watchdog() -> None:
    bench = RrcBench().power_on()
    bench.step("stablemode1")
    bench.step("watchdog034")
    assert bench.step("output00002") == ["ER:CommandChecksum"]
    assert bench.step("output00002") == ["ER:CommandChecksum"]
    assert bench.step("output00002") == ["ER:CommandChecksum", "EV:PowerOffWaitByWatchdog"]


def test_lines_in_one_tick_are_worked_on_two_at_a_time() -> None:
    bench = RrcBench().power_on()
    assert bench.step(*["device"] * 3) == ["OK:device", "RRC"] * 2
    assert bench.step() == ["OK:device", "RRC"]


def test_before_power_on_one_line_in_two_ticks_is_worked_on() -> None:
    bench = RrcBench().boot()
    bench.align()
    sent = [bench.step(*["stablemode0"] * 3), *(bench.step() for _ in range(4))]
    assert [len(lines) for lines in sent] == [1, 0, 1, 0, 1]


@pytest.mark.parametrize(
    ("received", "blocks"),
    [(b"x" * 9, 0), (b"x" * 16, 0), (b"x" * 17, 1), (b"x" * 16 + b"\n", 0), (b"x" * 17 + b"\n", 1)],
)
def test_blocks_of_the_buffer_size_count_from_the_byte_after_an_overflow(
    received: bytes, blocks: int
) -> None:
    buffer = ReceiveBuffer(8)
    buffer.push(received)
    assert (buffer.overflows, buffer.thrown_blocks) == (1, blocks)


def test_stablemode_is_asked_for_by_the_line_after_it_in_the_same_tick() -> None:
    bench = RrcBench().power_on()
    assert bench.step("stablemode1", "output0000") == ["OK:stablemode", "ER:CommandChecksum"]


def test_status_lines_stop_with_the_powered_period() -> None:
    bench = RrcBench().power_on()
    bench.step("statusA1")
    assert len(bench.run(5)) == 5
    assert bench.step("poweroff") == ["OK:poweroff", "EV:PowerOffWaitByHost"]
    assert bench.run(5) == []


def test_limit_mode_begins_without_a_gear() -> None:
    bench = RrcBench().enter("Limit")
    bench.step("joystick00006464002051e2d")
    bench.set(stick_v_pct=-50)
    bench.step()
    assert bench.rrc.read("gear") == "R"
    bench.step("output0000")
    bench.set(stick_v_pct=50)
    bench.step("limit6464ffffff")
    assert (bench.rrc.read("gear"), out(bench)) == ("F", (50, 0))


def test_a_repeated_limit_keeps_the_gear() -> None:
    bench = RrcBench().enter("Limit")
    bench.step("joystick00006464002051e2d")
    bench.set(stick_v_pct=-50)
    bench.step()
    bench.set(stick_v_pct=50)
    bench.step("limit6464ffffff")
    assert (bench.rrc.read("gear"), out(bench)) == ("R", (0, 0))


def test_a_joystick_command_takes_effect_at_once_in_limit_mode() -> None:
    bench = RrcBench().enter("Limit")
    bench.set(stick_v_pct=-50)
    bench.step()
    assert out(bench) == (-50, 0)
    bench.step("joystick00006464001051e2d")
    assert out(bench) == (0, 0)


def test_in_output_mode_a_joystick_command_is_taken_and_has_no_effect() -> None:
    bench = RrcBench().enter("Output")
    bench.set(stick_v_pct=-80, stick_w_pct=60)
    bench.step("output9c1e")
    assert bench.step("joystick00006464001051e2d") == ["OK:joystick"]
    bench.step()
    assert (bench.state, out(bench)) == ("Output", (-100, 30))
    bench.step("limit6464ffffff")
    assert out(bench) == (0, 60)  # reverse mode 1 was kept


def test_in_standby_nothing_drives_until_limit_or_output() -> None:
    bench = RrcBench().power_on()
    bench.set(stick_v_pct=80)
    bench.step("joystick00006464000051e2d", "speedmode50")
    bench.run(1_000)
    assert (bench.state, out(bench)) == ("Standby", (0, 0))
    bench.step("limit6464ffffff")
    assert (bench.state, out(bench)) == ("Limit", (80, 0))


@pytest.mark.parametrize("stable", [False, True])
def test_a_refused_command_changes_no_setting(stable: bool) -> None:
    bench = RrcBench().enter("Output")
    for line in ("watchdogff", "speedmode30", "joystick0a0a5a5aff2051e2d", f"stablemode{stable:d}"):
        bench.step(line)
    before = repr(bench.rrc._settings)
    for line in (
        *("limit65643232ff", "output6500", "speedmode61", "joystick32320a0a000651e2d"),
        *("joystick0a0a5a5aff0651e2g", "watchdog0", "stablemode2", "statusB1", "statusA2"),
        *("poweroff1", "speedmodeg0", "Speedmode10"),
    ):
        ends = [check_digit(line.encode()).decode(), "g"] if stable else [""]
        for end in ends:
            (reply,) = bench.step(line + end)
            assert reply.startswith("ER:")
            assert (bench.state, repr(bench.rrc._settings)) == ("Output", before)


@pytest.mark.parametrize(
    ("stable", "status", "pace"),
    [(False, False, 150), (False, True, 100), (True, False, 180), (True, True, 160)],
)
def test_it_says_how_fast_a_host_may_send(stable: bool, status: bool, pace: int) -> None:
    bench = RrcBench()
    assert bench.rrc.read("pace_lines_s") == 0
    assert bench.boot().rrc.read("pace_lines_s") == 45
    bench.enter("Output")
    bench.step(f"statusA{int(status)}")
    bench.step(f"stablemode{int(stable)}")
    bench.run(12)
    assert bench.rrc.read("pace_lines_s") == pace
    line = "output00001" if stable else "output0000"
    loads = []
    for tick in range(1_000):
        due = (tick + 1) * pace // 100 - tick * pace // 100
        bench.step(*[line] * due)
        loads.append(int(bench.rrc.read("load_pct")))
        assert int(bench.rrc.read("backlog_pct")) <= 40
    assert max(loads[10:]) <= 90
    assert bench.rrc.read("margin_pct") == 100 - loads[-1]
    bench.step("poweroff8" if stable else "poweroff")
    assert [bench.rrc.read(name) for name in ("load_pct", "margin_pct", "pace_lines_s")] == [
        0,
        100,
        45,
    ]


def test_other_work_leaves_a_host_less_time() -> None:
    bench = RrcBench().enter("Output")
    bench.set(extra_load_pct=40)
    bench.run(12)
    assert bench.rrc.read("load_pct") == 70
    assert bench.rrc.read("pace_lines_s") == 50
    bench.set(extra_load_pct=90)
    bench.run(2)
    assert bench.rrc.read("pace_lines_s") == 0
    bench.run(9)
    assert bench.rrc.read("margin_pct") == -20


@pytest.mark.parametrize(("stable", "status"), [(False, False), (False, True), (True, True)])
def test_eight_lines_in_each_period_stop_vr2_in_the_second(stable: bool, status: bool) -> None:
    bench = RrcBench().enter("Output")
    bench.step(f"statusA{int(status)}")
    bench.step(f"stablemode{int(stable)}")
    bench.run(3)
    line = "output00001" if stable else "output0000"
    stops = ["EV:PowerOffWaitByOverTime" in bench.step(*[line] * 8) for _ in range(2)]
    assert stops == [False, True]


def test_two_lines_with_check_and_status_are_exactly_all_that_it_can() -> None:
    bench = RrcBench().enter("Output")
    bench.step("statusA1")
    bench.step("stablemode1")
    bench.run(10)
    assert bench.rrc.read("backlog_pct") == 0
    for backlog in (25, 50, 75):  # one line too many each time: nothing of it drains
        bench.step(*["output00001"] * 3)
        for _ in range(100):
            bench.step(*["output00001"] * 2)
            assert bench.rrc.read("backlog_pct") == backlog
    assert bench.rrc.read("load_pct") == 100


@pytest.mark.parametrize("command", ["limit6464ffffff", "output3200"])
def test_too_much_work_stops_the_motors_in_the_tick_that_tells_it(command: str) -> None:
    bench = RrcBench().enter("Standby")
    bench.set(stick_v_pct=50)
    bench.step(command)
    assert bench.rrc.read("out_v_pct") == 50
    bench.set(extra_load_pct=400)
    assert bench.step() == ["EV:PowerOffWaitByOverTime"]
    assert [bench.rrc.read(name) for name in ("out_v_pct", "stick_drives")] == [0, 0]


def test_at_exactly_all_that_it_can_a_clock_that_is_fast_stops_vr2_after_a_minute() -> None:
    bench = RrcBench().enter("Output")
    bench.step("statusA1")
    bench.step("stablemode1")
    bench.run(10)
    sent = 0
    for tick in range(1, 6_001):
        assert bench.state == "Output"
        due = 2 * tick * 1_001 // 1_000
        bench.step(*["output00001"] * (due - sent))
        sent = due
    assert bench.state == "PowerOffByOthers"
