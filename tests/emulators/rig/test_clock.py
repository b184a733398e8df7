from __future__ import annotations

from tickrig.emulators.rig.clock import VirtualClock


def test_virtual_time_is_never_late() -> None:
    assert VirtualClock().wait_until(10**15) == 0
