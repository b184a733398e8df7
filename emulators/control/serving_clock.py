"""A real clock that serves a control socket while it waits."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.emulators.rig.clock import RealClock


class ServingClock(RealClock):
    """The monotonic clock of this machine; what it would sleep, it serves.

    Attributes:
        serve: called with the time in microseconds that it may take; at least
            once for each wait, so that an emulator that is late can be stopped.
    """

    serve: Callable[[int], None] | None = None

    def wait_until(self, t_us: int, /) -> int:
        """Serve, then sleep until `t_us`."""
        if self.serve is not None:
            self.serve(0)
            while (early_us := t_us - self.now_us) > 0 and self.now_us:
                self.serve(early_us)
        return super().wait_until(t_us)
