"""The clock of a rig in virtual time; that of this machine is `host.control.clock.RealClock`."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """Time since the rig was started, in microseconds."""

    def wait_until(self, t_us: int, /) -> int:
        """Wait until `t_us`; return the delay in microseconds, 0 if on time."""
        ...


class VirtualClock:
    """Virtual time, which passes as fast as the rig computes and is never late."""

    def wait_until(self, t_us: int, /) -> int:
        """Return at once: in virtual time it is already `t_us`."""
        return 0
