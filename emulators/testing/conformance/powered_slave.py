"""A slave with a switch in its supply, for the stimulus `power`."""

from __future__ import annotations

from tickrig.emulators.testing.conformance.slave import Slave
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


class PoweredSlave:
    """A slave that can be switched off and on.

    Args:
        slave: what is judged; it is on.
    """

    def __init__(self, slave: Slave) -> None:
        self.slave, self._on = slave, True
        self._woken = False

    @property
    def tick_us(self) -> int:
        """That of the slave."""
        return self.slave.tick_us

    @property
    def due_us(self) -> int:
        """That of the slave, `NEVER` while it is off."""
        if not self._on:
            return NEVER
        return 0 if self._woken else self.slave.due_us

    def reset(self) -> None:
        """Lose and get back the power."""
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Let the slave do what it does, if it is on."""
        self._woken = False
        return self.slave.tick(now_us, rx) if self._on else ()

    def switch(self, *, on: bool) -> None:
        """Switch the power; on when it is on does nothing."""
        if on and not self._on:
            self.slave.reset()
            self._woken = True
        self._on = on
