"""The RRC manual's test procedure, steps 3 to 5: power-on and the nine samples."""

from __future__ import annotations

import pytest

from tests.hil.rrc.chair import PATIENCE_US, Chair
from tickrig.wire.rrc.commands import Joystick
from tickrig.wire.rrc.replies import RrcEvent

pytestmark = pytest.mark.needs("device:rrc")


def test_the_power_button_brings_vr2_on(chair: Chair) -> None:
    chair.press("power_button")
    on = chair.client.wait_for(RrcEvent.POWER_ON, PATIENCE_US)
    success = chair.client.wait_for(RrcEvent.POWER_ON_SUCCESS, PATIENCE_US)
    assert on.at_us <= success.at_us
    assert chair.sees_motion(0, 0)


def test_limit_halves_the_stick(ready: Chair) -> None:
    ready.client.status()
    ready.client.limit(v_pct=50, w_pct=50)
    ready.hold_stick(100, 0)
    status = ready.status()
    assert ready.near(status.in_v_pct, 100)
    assert ready.near(status.out_v_pct, 50)
    assert status.out_v_pct <= 50
    assert ready.sees_motion(50, 0)
    assert ready.sent(b"limit3232ffffff", b"D")


def test_output_drives_forward(ready: Chair) -> None:
    ready.client.status()
    ready.client.output(v_pct=30, w_pct=0)
    status = ready.status()
    assert (status.out_v_pct, status.out_w_pct) == (30, 0)
    assert ready.sees_motion(30, 0)
    assert ready.sent(b"output1e00", b"7")


def test_speedmode_4_leaves_the_buttons_unlocked(ready: Chair) -> None:
    ready.client.status()
    ready.client.speedmode(4)
    assert ready.status().speed_mode == 4
    ready.press("speed_up_button")
    assert ready.status().speed_mode == 5
    assert ready.sent(b"speedmode40", b"A")


def test_joystick_in_mode_3_backs_toward_the_stick(ready: Chair) -> None:
    ready.client.status()
    ready.client.joystick(Joystick(reverse_mode=3, neutral_pct=5, switch_deg=30, fade_deg=45))
    ready.client.limit(100, 100)
    ready.hold_stick(0, 0)
    ready.client.run_for(300_000)
    ready.hold_stick(-60, 20)
    status = ready.status()
    assert ready.near(status.out_v_pct, -60)
    assert ready.near(status.out_w_pct, -20)
    assert ready.sees_motion(-60, -20)
    assert ready.sent(b"joystick00006464003051e2d", b"8")


def test_joystick_in_mode_3_turns_on_the_spot_beyond_30_degrees(ready: Chair) -> None:
    ready.client.status()
    ready.client.joystick(Joystick(reverse_mode=3, neutral_pct=5, switch_deg=30, fade_deg=45))
    ready.client.limit(100, 100)
    ready.hold_stick(0, 0)
    ready.client.run_for(300_000)
    ready.hold_stick(-60, 60)
    status = ready.status()
    assert status.out_v_pct == 0
    assert ready.near(status.out_w_pct, 60)
    assert ready.sees_motion(0, 60)


def test_joystick_in_mode_3_stands_still_near_the_middle(ready: Chair) -> None:
    ready.client.status()
    ready.client.joystick(Joystick(reverse_mode=3, neutral_pct=5, switch_deg=30, fade_deg=45))
    ready.client.limit(100, 100)
    ready.hold_stick(3, 3)
    status = ready.status()
    if max(abs(status.in_v_pct), abs(status.in_w_pct)) > 3:
        pytest.skip("no hand can hold the stick within 5 %")
    assert (status.out_v_pct, status.out_w_pct) == (0, 0)


def test_watchdog_stops_vr2_after_1_s_of_silence(ready: Chair) -> None:
    ready.client.watchdog(1_000_000)
    assert ready.sent(b"watchdog64", b"B")
    last_us, _ = ready.link.sent[-1]
    ready.hang()
    trip = ready.client.wait_for(RrcEvent.BY_WATCHDOG, PATIENCE_US)
    assert 990_000 <= trip.at_us - last_us <= 1_030_000 + ready.late_us
    assert ready.sees_error()


def test_status_comes_each_10_ms(ready: Chair) -> None:
    ready.client.status()
    ready.client.run_for(200_000)
    times_us = [arrival.at_us for arrival in ready.client.statuses(0)]
    mean_us = (times_us[-1] - times_us[0]) / (len(times_us) - 1)
    assert abs(mean_us - 10_000) <= 100 + ready.late_us / 50
    assert ready.sent(b"statusA1", b"6")


def test_stablemode_wants_check_and_leaves_out_ok(standby: Chair) -> None:
    standby.client.stablemode()
    heard = len(standby.link.heard)
    standby.link.send(b"output1e00\n")
    standby.client.output(0, 0, confirm=False)
    standby.client.run_for(100_000)
    assert standby.link.heard[heard:] == b"ER:CommandChecksum\n"


def test_poweroff_stops_vr2(ready: Chair) -> None:
    ready.client.output(30, 0)
    ready.client.poweroff()
    ready.client.wait_for(RrcEvent.BY_HOST, PATIENCE_US)
    assert ready.sees_motion(0, 0)
    assert ready.sees_error()
    assert ready.sent(b"poweroff", b"8")


def test_beep_sounds_two_long_and_three_short_tones(ready: Chair) -> None:
    times_us = (*[1_000_000] * 4, *[100_000] * 6)
    ready.client.beep(*times_us)
    assert ready.hears_tones(times_us)
    assert ready.sent(b"beep646464640a0a0a0a0a0a", b"a")
