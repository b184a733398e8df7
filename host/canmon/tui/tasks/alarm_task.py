"""Rules held against what a session hears."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.canmon.tui.tasks.model import Meant, Model
from tickrig.host.monitor.check.alarms import Alarms
from tickrig.host.monitor.check.rules import Rules
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

LOOK_US: Final = 100_000
"""How often it is seen whether something is missing."""


class AlarmTask:
    """Takes frames, and looks for what is missing; it sends nothing.

    Args:
        model: tells the time of the source, and what was lost.

    Attributes:
        alarms: how the rules stand.
    """

    channel = ""

    def __init__(self, model: Model) -> None:
        self._model = model
        self.alarms = Alarms(Rules(), self.bit_rate)
        self._due_us = NEVER

    @property
    def bit_rate(self) -> int | None:
        """Of the buses, None if it is not known."""
        return self._model.top.view.bit_rate

    @property
    def due_us(self) -> int:
        """When it next wants to be called without a frame."""
        return self._due_us

    def hold(self, rules: Rules) -> None:
        """Hold other rules from now on; ValueError for a limit of the load without a bit rate."""
        self.alarms = Alarms(rules, self.bit_rate)
        self._due_us = NEVER if rules == Rules() else 0

    def tick(self, now_us: int, heard: Sequence[Meant], /) -> Frames:
        """Take what was heard."""
        if self._due_us == NEVER:
            return ()
        for one, _ in heard:
            self.alarms.take(one)
        if now_us >= self._due_us:
            self._due_us = now_us + LOOK_US
            self.alarms.look(self._model.now_us, self._model.lost)
        return ()

    def stop(self) -> None:
        """Do nothing: it sends nothing."""
