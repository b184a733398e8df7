"""The time of a rig, for hosts that look at a clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import EPOCH_S, LOOK_US
from tickrig.emulators.testing.host_clock.errors import HostTimeError

LONGEST_US: Final = 3_600_000_000
"""Who waits without a timeout waits an hour at most."""


class RigPassing:
    """A `Passing` that is a rig's time.

    What is called back in the middle of a step may look at the clock, but not wait.

    Args:
        rig: stepped while somebody waits.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @property
    def time_s(self) -> float:
        """Seconds since 1970: a rig begins with the year 2000."""
        return EPOCH_S + self._rig.now_us / 1e6

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        """Let time pass until `done()`; False if the timeout was first.

        Without a timeout it is False once nothing happens any more, or after an hour.

        Raises:
            HostTimeError: it is the rig that has called, in the middle of a step.
        """
        timeout_us = LONGEST_US if timeout_s is None else max(0, round(timeout_s * 1e6))
        if not self._rig.in_step:
            return self._rig.run_until(done, timeout_us)
        if timeout_us > LOOK_US:
            raise HostTimeError("what is called back while time passes cannot wait itself")
        return done()
