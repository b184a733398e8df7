"""What must stop VR2, and that it runs again afterwards."""

from __future__ import annotations

import pytest

from tests.hil.rrc.chair import PATIENCE_US, Chair
from tickrig.host.rrc import RrcRefused, RrcStopped
from tickrig.wire.rrc.replies import RrcEvent

pytestmark = pytest.mark.needs("device:rrc")

WATCHDOG_US = 300_000


def drive(chair: Chair) -> None:
    """Drive forward as the manual demands it: with stablemode and watchdog."""
    chair.client.stablemode()
    chair.client.watchdog(WATCHDOG_US)
    chair.client.output(30, 0, confirm=True)
    chair.client.run_for(50_000)


def stream(chair: Chair) -> None:
    """Send the same output again and again, as a control loop does."""
    for _ in range(20):
        chair.client.output(30, 0)
        chair.client.run_for(20_000)


def test_a_host_that_hangs_stops_the_motors(standby: Chair) -> None:
    drive(standby)
    standby.hang()
    standby.client.wait_for(RrcEvent.BY_WATCHDOG, WATCHDOG_US + 50_000 + standby.late_us)
    assert standby.sees_motion(0, 0)
    assert standby.sees_error()


def test_a_host_that_waits_keeps_driving(standby: Chair) -> None:
    drive(standby)
    standby.client.run_for(3 * WATCHDOG_US)
    assert standby.sees_motion(30, 0)


def test_commands_in_error_do_not_renew_the_watchdog(standby: Chair) -> None:
    drive(standby)
    standby.link.spoil = lambda line: b"?" + line
    with pytest.raises(RrcStopped, match="CommandChecksum"):
        standby.client.run_for(PATIENCE_US)
    standby.client.wait_for(RrcEvent.BY_WATCHDOG, WATCHDOG_US + 50_000 + standby.late_us)
    assert standby.sees_motion(0, 0)


def test_three_checksum_errors_in_a_row_power_vr2_off(standby: Chair) -> None:
    drive(standby)
    standby.link.spoil = lambda line: line.replace(b"output1e00", b"output1e01")
    with pytest.raises(RrcStopped):
        stream(standby)
    standby.client.wait_for(RrcEvent.BY_HOST, 50_000 + standby.late_us)
    assert standby.sees_motion(0, 0)


def test_one_checksum_error_changes_nothing(standby: Chair) -> None:
    drive(standby)
    standby.link.send(b"output64007\n")
    standby.client.run_for(100_000)
    assert b"ER:CommandChecksum\n" in standby.link.heard
    assert standby.sees_motion(30, 0)


def test_nothing_drives_before_vr2_is_on(chair: Chair) -> None:
    with pytest.raises(RrcRefused, match="ER:output"):
        chair.client.output(30, 0)
    with pytest.raises(RrcRefused, match="ER:limit"):
        chair.client.limit(100, 100)
    assert chair.sees_motion(0, 0)


def test_the_power_button_stops_the_motors(standby: Chair) -> None:
    drive(standby)
    standby.press("power_button")
    standby.client.wait_for(RrcEvent.BY_BUTTON, PATIENCE_US)
    standby.client.wait_for(RrcEvent.POWER_OFF_FINISHED, PATIENCE_US)
    assert standby.sees_motion(0, 0)
    assert not standby.sees_error()


def test_a_power_cycle_after_a_forced_stop_begins_afresh(standby: Chair) -> None:
    drive(standby)
    standby.client.speedmode(5)
    standby.client.poweroff()
    standby.client.wait_for(RrcEvent.BY_HOST, PATIENCE_US)
    standby.switch_off()
    assert (standby.client.stable, standby.client.watchdog_us) == (False, 0)
    standby.switch_on()
    standby.client.status()
    assert standby.status().speed_mode == 1
    drive(standby)
    assert standby.sees_motion(30, 0)


def test_a_power_cut_of_the_rrc_stops_the_motors(standby: Chair) -> None:
    drive(standby)
    standby.cut_power()
    standby.client.wait_for(RrcEvent.INITIALIZED, PATIENCE_US)
    assert standby.sees_motion(0, 0)
    assert not standby.client.stable


def test_too_much_work_stops_the_motors(standby: Chair) -> None:
    drive(standby)
    standby.bench.set("extra_load_pct", 200)
    standby.client.wait_for(RrcEvent.BY_OVER_TIME, PATIENCE_US)
    standby.bench.set("extra_load_pct", 0)
    assert standby.sees_motion(0, 0)


@pytest.mark.parametrize(
    ("fault", "event"),
    [
        ("bus_noise", RrcEvent.BY_COMMUNICATION_ERROR),
        ("joystick_fault", RrcEvent.BY_JOYSTICK_MODULE_ERROR),
        ("power_module_fault", RrcEvent.BY_POWER_MODULE_ERROR),
        ("vr2_fault", RrcEvent.BY_SYSTEM_ERROR),
        ("bus_unplugged", RrcEvent.BY_NO_COMMUNICATION),
    ],
)
def test_a_fault_of_vr2_stops_the_motors(standby: Chair, fault: str, event: RrcEvent) -> None:
    drive(standby)
    standby.bench.set(fault, 1)
    standby.client.wait_for(event, PATIENCE_US)
    standby.bench.set(fault, 0)
    assert standby.sees_motion(0, 0)
    assert standby.sees_error()
