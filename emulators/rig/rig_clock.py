"""The time of a rig, for what runs beside it."""

from __future__ import annotations

from tickrig.emulators.rig.rig import Rig


class RigClock:
    """A clock whose time passes as its rig is stepped.

    With it a system of RT components (`host.rtc.real_time`) and the emulated
    devices behind its proxies run in virtual time together.

    Args:
        rig: stepped while somebody waits.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig, self._start_us = rig, rig.now_us

    def wait_until(self, t_us: int, /) -> int:
        """Step the rig until it is `t_us`; return by how much it was late."""
        late_us = self._rig.now_us - self._start_us - t_us
        if late_us < 0:
            self._rig.run_for(-late_us)
        return max(0, late_us)
