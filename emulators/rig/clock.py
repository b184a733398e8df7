"""The clock of a rig in virtual time; `host.control.clock.RealClock` is the machine's clock."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """Time since the rig was started, in microseconds."""

    def wait_until(self, t_us: int, /) -> int:
        """Wait until `t_us`; return the delay in microseconds, which is 0 if on time."""
        ...


class VirtualClock:
    """Virtual time, which passes as fast as the rig computes and is never late."""

    def wait_until(self, t_us: int, /) -> int:
        """Return at once: in virtual time it is already `t_us`."""
        return 0
