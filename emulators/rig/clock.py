"""The clock of a rig in virtual time; that of this machine is `host.control.clock.RealClock`."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """Time since the rig was started, in microseconds."""

    def wait_until(self, t_us: int, /) -> int:
        """Return when it is `t_us`; the answer is how late in microseconds, 0 if on time."""
        ...


class VirtualClock:
    """Time that passes as fast as the rig can compute: never late."""

    def wait_until(self, t_us: int, /) -> int:
        """Return at once: in virtual time it is already `t_us`."""
        return 0
