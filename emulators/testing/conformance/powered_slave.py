"""A slave with a switch in its supply, for the stimulus `power`."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.emulators.testing.conformance.called_slave import checked_frames
from tickrig.emulators.testing.conformance.slave import Slave
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


class PoweredSlave:
    """A slave that can be switched off and on.

    What it raises is told, and then its program begins anew, as after a watchdog; one that cannot
    is dead until the power is switched.

    Args:
        slave: what is judged; it is on.

    Attributes:
        on_crash: is told what it has raised.
    """

    def __init__(self, slave: Slave) -> None:
        self.slave, self._on = slave, True
        self._woken = self._dead = False
        self.on_crash: Callable[[Exception], object] = lambda error: None

    @property
    def tick_us(self) -> int:
        """That of the slave."""
        return self.slave.tick_us

    @property
    def due_us(self) -> int:
        """That of the slave, `NEVER` while it is off."""
        if not self._on or self._dead:
            return NEVER
        return 0 if self._woken else self.slave.due_us

    def reset(self) -> None:
        """Lose and get back the power."""
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Let the slave do what it does, if it is on."""
        self._woken = False
        if not self._on or self._dead:
            return ()
        try:
            sent = self.slave.tick(now_us, rx)
            return checked_frames(sent) if sent != () else sent
        except Exception as error:
            self._begin_anew(error)
            return ()

    def switch(self, *, on: bool) -> None:
        """Switch the power; on when it is on does nothing."""
        if on and not self._on:
            self._reset()
        self._on = on

    def _begin_anew(self, error: Exception) -> None:
        self.on_crash(error)
        self._reset()

    def _reset(self) -> None:
        self._woken, self._dead = True, False
        try:
            self.slave.reset()
        except Exception as error:
            self._dead = True
            self.on_crash(error)
