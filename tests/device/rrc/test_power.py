"""States S0 to S8 and the ways between them that the golden vectors do not time."""

from __future__ import annotations

import pytest

from tests.device.rrc.bench import RrcBench
from tickrig.device.rrc.settings import RrcConfig, Settings
from tickrig.wire.instant import NEVER

CAUSES = {
    "bus_noise": "CommunicationError",
    "joystick_fault": "JoystickModuleError",
    "power_module_fault": "PowerModuleError",
    "vr2_fault": "SystemError",
    "bus_unplugged": "NoCommunication",
}


def test_the_first_tick_with_power_ends_initialize() -> None:
    bench = RrcBench()
    assert bench.state == "Off"
    assert bench.step() == ["EV:Initialized"]


def test_power_on_takes_30_ticks() -> None:
    bench = RrcBench().boot()
    bench.set(power_button=1)
    assert bench.step() == ["EV:PowerOnTrigger"]
    assert bench.run(29) == []
    assert bench.step() == ["EV:PowerOnSuccess"]


def test_a_second_press_during_power_on_changes_nothing() -> None:
    bench = RrcBench().boot()
    bench.tap("power_button")
    bench.tap("power_button")
    assert bench.run(27) == ["EV:PowerOnSuccess"]


def test_power_on_without_the_bus_times_out_after_3_s() -> None:
    bench = RrcBench().boot()
    bench.set(bus_unplugged=1, power_button=1)
    assert bench.step() == ["EV:PowerOnTrigger"]
    assert bench.run(299) == []
    assert bench.step() == ["EV:PowerOnTimeout"]
    assert bench.state == "WaitPowerOn"


def test_a_bus_that_is_plugged_in_late_still_powers_on() -> None:
    bench = RrcBench().boot()
    bench.set(bus_unplugged=1)
    bench.tap("power_button")
    bench.run(100)
    bench.set(bus_unplugged=0)
    assert bench.step() == ["EV:PowerOnSuccess"]


@pytest.mark.parametrize(
    ("fault", "event"),
    [
        ("bus_noise", "EV:PowerOnError1"),
        ("joystick_fault", "EV:PowerOnError1"),
        ("power_module_fault", "EV:PowerOnError2"),
        ("vr2_fault", "EV:PowerOnError2"),
    ],
)
def test_a_fault_at_power_on_has_its_error(fault: str, event: str) -> None:
    bench = RrcBench().boot()
    bench.set(**{fault: 1})
    bench.tap("power_button")
    assert bench.run(30) == [event]
    assert bench.state == "WaitPowerOn"


@pytest.mark.parametrize("state", ["Standby", "Limit", "Output"])
@pytest.mark.parametrize(("fault", "cause"), CAUSES.items())
def test_a_fault_is_detected_100_ms_after_its_first_tick(
    fault: str, cause: str, state: str
) -> None:
    bench = RrcBench().enter(state)
    bench.set(**{fault: 1})
    assert bench.run(10) == []
    assert bench.step() == [f"EV:PowerOffWaitBy{cause}"]
    assert bench.state == "PowerOffByOthers"


def test_a_fault_that_goes_away_in_time_is_forgotten() -> None:
    bench = RrcBench().enter("Standby")
    for _ in range(3):
        bench.set(bus_noise=1)
        assert bench.run(10) == []
        bench.set(bus_noise=0)
        assert bench.run(1) == []


def test_a_change_of_mode_does_not_hide_a_fault() -> None:
    bench = RrcBench().enter("Limit")
    bench.set(bus_noise=1)
    bench.run(9)
    assert bench.step("output0000") == ["OK:output"]
    assert bench.step() == ["EV:PowerOffWaitByCommunicationError"]


def test_off_by_button_takes_50_ticks_and_starts_again() -> None:
    bench = RrcBench().enter("Limit")
    bench.set(power_button=1)
    assert bench.step() == ["EV:PowerOffWaitByButton"]
    assert bench.run(49) == []
    assert bench.step() == ["EV:PowerOffFinished"]
    assert bench.step() == ["EV:Initialized"]


@pytest.mark.unmeasured
def test_a_forced_stop_waits_for_the_power_button() -> None:
    bench = RrcBench().enter("PowerOffByOthers")
    assert bench.run(10_000) == []
    assert bench.rrc.read("error_led") == 1
    bench.set(power_button=1)
    assert bench.run(10) == []
    assert bench.step() == ["EV:PowerOffFinished"]
    assert bench.step() == ["EV:Initialized"]
    assert bench.rrc.read("error_led") == 0


def test_motors_stop_with_the_forced_stop() -> None:
    bench = RrcBench().power_on()
    bench.step("output6432")
    assert (bench.rrc.read("out_v_pct"), bench.rrc.read("out_w_pct")) == (100, 50)
    bench.step("poweroff")
    assert (bench.rrc.read("out_v_pct"), bench.rrc.read("out_w_pct")) == (0, 0)


def test_vr2_off_and_on_wipes_every_setting() -> None:
    bench = RrcBench().power_on()
    for line in ("speedmode41", "watchdog05", "statusA1", "beepffffffffffffffffffff"):
        bench.step(line)
    bench.tap("power_button")
    bench.run(60)
    bench.power_on()
    assert bench.rrc.read("speed_mode") == 1
    assert bench.run(100) == []  # no SA lines, no watchdog
    assert bench.rrc.read("buzzer") == 0
    bench.tap("speed_up_button")
    assert bench.rrc.read("speed_mode") == 2  # not locked


def test_a_power_cut_in_the_middle_of_a_line_forgets_it() -> None:
    bench = RrcBench().enter("Standby")
    bench.step(raw=b"outp")
    bench.set(rrc_power=0)
    assert bench.step(raw=b"ut0000\n") == []
    assert bench.state == "Off"
    assert bench.rrc.due_us == NEVER
    bench.set(rrc_power=1)
    assert bench.step() == ["EV:Initialized"]
    assert bench.run(10) == []


def test_a_press_during_initialize_is_seen_in_the_tick_after_it() -> None:
    bench = RrcBench()
    bench.set(power_button=1)
    assert bench.step() == ["EV:Initialized"]
    assert bench.step() == ["EV:PowerOnTrigger"]


def test_a_button_still_held_from_switching_off_does_not_switch_on_again() -> None:
    bench = RrcBench().enter("PowerOffByOthers")
    bench.set(power_button=1)
    assert bench.run(100) == ["EV:PowerOffFinished", "EV:Initialized"]


def test_lines_that_wait_survive_vr2_being_switched_off() -> None:
    bench = RrcBench().enter("PowerOffByButton")
    sent = bench.step(raw=b"device\n" * 5) + bench.run(60)
    assert sent.count("RRC") == 5


def test_an_unknown_output_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        RrcBench().rrc.read("smell")


def test_every_declared_output_can_be_read() -> None:
    rrc = RrcBench().rrc
    assert all(isinstance(rrc.read(name), int | str) for name in rrc.outputs)


@pytest.mark.parametrize("line", ["stablemode1", "watchdog03", "speedmode41", "statusA1"])
def test_what_commands_set_during_initialize_is_wiped_at_its_end(line: str) -> None:
    bench = RrcBench().enter("PowerOffByButton")
    bench.run(48)
    bench.align()
    assert bench.step(line) == ["EV:PowerOffFinished", f"OK:{line.rstrip('A0123456789')}"]
    assert bench.step() == ["EV:Initialized"]
    assert bench.rrc._settings == Settings()
    assert bench.step("version") == ["OK:version", "Version 1.0"]


def test_a_beep_of_initialize_ends_with_it() -> None:
    bench = RrcBench(RrcConfig(initialize_ticks=20))
    bench.step()
    bench.step("beepff000000000000000000")
    bench.step()
    assert bench.rrc.read("buzzer") == 1
    assert bench.run(17) == ["EV:Initialized"]
    assert bench.rrc.read("buzzer") == 0
