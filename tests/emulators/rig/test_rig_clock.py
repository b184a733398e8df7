from __future__ import annotations

from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import RigClock


def test_waiting_steps_the_rig() -> None:
    rig = Rig()
    rig.run_for(5_000_000)
    clock = RigClock(rig)
    assert clock.wait_until(20_000) == 0
    assert rig.now_us == 5_020_000


def test_who_waits_for_the_past_is_late() -> None:
    rig = Rig()
    clock = RigClock(rig)
    rig.run_for(1_000)
    assert clock.wait_until(400) == 600
    assert rig.now_us == 1_000
