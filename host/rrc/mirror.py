"""What the client believes about the settings of its RRC."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.wire.rrc.commands import Command, Limit, Output, SpeedMode, StableMode, Watchdog
from tickrig.wire.rrc.replies import EventKind

WIPING: Final = (EventKind.POWER_OFF_FINISHED, EventKind.INITIALIZED)
"""Events after which the RRC has none of its settings (RRC manual, notes)."""


@dataclass(slots=True)
class Mirror:
    """Settings that change how the client talks.

    Attributes:
        stable: stablemode: CHECK on every line, no OK.
        watchdog_10ms: time of the watchdog, 0 is off.
        locked: whether the controller's speed buttons are locked.
        drive: the command that chose who drives, None if that is not certain.
    """

    stable: bool = False
    watchdog_10ms: int = 0
    locked: int = 0
    drive: type[Limit | Output] | None = None

    def sent(self, command: Command) -> None:
        """Note a command whose fate is not waited for; who drives may have changed."""
        if isinstance(command, Limit | Output) and self.drive is not type(command):
            self.drive = None
        else:
            self.accepted(command)

    def accepted(self, command: Command) -> None:
        """Note a command that the RRC carried out."""
        match command:
            case StableMode(on):
                self.stable = bool(on)
            case Watchdog(time_10ms):
                self.watchdog_10ms = time_10ms
            case SpeedMode(_, locked):
                self.locked = locked
            case Limit() | Output():
                self.drive = type(command)

    def wiped(self) -> None:
        """Forget the settings, as the RRC does in Initialize."""
        self.stable, self.watchdog_10ms, self.locked, self.drive = False, 0, 0, None
