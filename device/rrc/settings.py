"""What Initialize wipes: all that commands and buttons have set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.wire.rrc.commands import (
    Command,
    Joystick,
    Limit,
    Output,
    SpeedMode,
    StableMode,
    Status,
    Watchdog,
)

NO_LIMIT_YET: Final = Limit(0, 0, 0, 0, 0)
NO_OUTPUT_YET: Final = Output(0, 0)
PLAIN_STICK: Final = Joystick()


@dataclass(slots=True)
class Settings:
    """Settings of the RRC, fresh at each pass through Initialize (RRC manual, notes).

    Attributes:
        stable: stablemode: CHECK wanted, OK left out.
        status: SA lines wanted.
        watchdog_ticks: time without a correct command that stops VR2, 0 for never.
        speed_mode: 1 (slowest) to 5.
        speed_locked: the controller's speed buttons have no effect.
        limit: limits of limit mode.
        output: values of output mode.
        joystick: stick shaping.
        button_mode: reverse mode that the buttons chose in Standby; None: the stick
            does not drive there.
        speed_up_count: button counter of SA, 0..15; odd while pressed.
        speed_down_count: the same.
        alarm_count: the same.
    """

    stable: bool = False
    status: bool = False
    watchdog_ticks: int = 0
    speed_mode: int = 1
    speed_locked: bool = False
    limit: Limit = NO_LIMIT_YET
    output: Output = NO_OUTPUT_YET
    joystick: Joystick = PLAIN_STICK
    button_mode: int | None = None
    speed_up_count: int = 0
    speed_down_count: int = 0
    alarm_count: int = 0

    def store(self, command: Command) -> None:
        """Take over what a command sets."""
        match command:
            case Limit():
                self.limit = command
            case Output():
                self.output = command
            case Joystick():
                self.joystick = command.after(self.joystick)
            case SpeedMode(mode, locked):
                self.speed_mode, self.speed_locked = mode, bool(locked)
            case Watchdog(ticks):
                self.watchdog_ticks = ticks
            case StableMode(on):
                self.stable = bool(on)
            case Status(on):
                self.status = bool(on)
            case _:
                return  # a question, a beep, poweroff: nothing to keep
