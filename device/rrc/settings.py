"""Configuration and settings of an RRC, and its states."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from tickrig.device.twin import Immutable
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
from tickrig.wire.rrc.replies import POWER_ON_TRIGGER, RrcEvent

# States and transitions of the RRC (RRC manual, state diagram and its conditions 1 to 9).


class RrcState(Enum):
    """The states of the diagram, S0 to S8."""

    OFF = "Off"
    INITIALIZE = "Initialize"
    WAIT_POWER_ON = "WaitPowerOn"
    STANDBY = "Standby"
    LIMIT = "Limit"
    OUTPUT = "Output"
    POWER_OFF_BY_BUTTON = "PowerOffByButton"
    POWER_OFF_BY_OTHERS = "PowerOffByOthers"
    POWER_OFF_FINISHED = "PowerOffFinished"


class Move(Enum):
    """Events that change the state of the RRC."""

    INITIALIZED = auto()
    POWER_ON_FAILED = auto()
    POWER_ON_SUCCEEDED = auto()
    LIMIT = auto()
    OUTPUT = auto()
    POWER_BUTTON = auto()
    FORCED = auto()
    TRAFFIC_ENDED = auto()
    RESTART = auto()


POWERED_ON: Final = (RrcState.STANDBY, RrcState.LIMIT, RrcState.OUTPUT)
"""The "PowerOnSuccess period" of the manual: VR2 runs."""

NEXT_STATE: Final[dict[tuple[RrcState, Move], RrcState]] = {
    (RrcState.INITIALIZE, Move.INITIALIZED): RrcState.WAIT_POWER_ON,  # 2
    # 3 stays in WAIT_POWER_ON, or starts again (DECISION R3)
    (RrcState.WAIT_POWER_ON, Move.POWER_ON_FAILED): RrcState.INITIALIZE,
    (RrcState.WAIT_POWER_ON, Move.POWER_ON_SUCCEEDED): RrcState.STANDBY,  # 4
    **{(state, Move.LIMIT): RrcState.LIMIT for state in POWERED_ON},  # 5 (DECISION R4)
    **{(state, Move.OUTPUT): RrcState.OUTPUT for state in POWERED_ON},  # 6 (DECISION R4)
    **{(state, Move.POWER_BUTTON): RrcState.POWER_OFF_BY_BUTTON for state in POWERED_ON},  # 7
    **{(state, Move.FORCED): RrcState.POWER_OFF_BY_OTHERS for state in POWERED_ON},  # 8
    (RrcState.POWER_OFF_BY_BUTTON, Move.TRAFFIC_ENDED): RrcState.POWER_OFF_FINISHED,  # 9
    (RrcState.POWER_OFF_BY_OTHERS, Move.TRAFFIC_ENDED): RrcState.POWER_OFF_FINISHED,  # 9
    (RrcState.POWER_OFF_FINISHED, Move.RESTART): RrcState.INITIALIZE,  # "at once"
}


# Configuration: differences between RRCs, and points that the manual leaves open.


class FailTarget(Enum):
    """Next state after a failed power-on (DECISION R3)."""

    WAIT = "wait"  # wait for the button again, settings kept
    INITIALIZE = "initialize"  # through Initialize, settings wiped


@dataclass(frozen=True, slots=True)
class RrcConfig(Immutable):
    """Configuration of an emulated RRC. Times are in ticks of 10 ms.

    Attributes:
        device_name: answer to `device`.
        version: answer to `version`.
        date: answer to `date`.
        power_on_event: name of the event: `PowerOnTrigger` as in the field, or `PowerOn` as in the
            manual's event table (DECISION R7).
        power_on_fail_target: target of transition 3 (DECISION R3).
        initialize_ticks: length of Initialize (DECISION R6).
        power_on_ticks: time from the power button to the result (DECISION R6).
        power_on_timeout_ticks: time from the power button to `PowerOnTimeout` (DECISION R6).
        button_off_ticks: time from the power button to `PowerOffFinished` (DECISION R6).
        forced_off_ticks: time from the power button to `PowerOffFinished` after a forced stop
            (DECISION R6).
        fault_hold_ticks: time that a fault must last to be detected (DECISION R25).
        buffer_bytes: size of the receive buffer (DECISION R27).
        overtime: whether too much work stops VR2 (DECISION R27).
        vehicle: whether VR2 drives a vehicle, with speed, distance and battery.
        battery_wh: capacity of the battery, in Wh.

    Raises:
        ValueError: a time, size or battery is below 1, or an event name is not in the manual.
    """

    device_name: str = "RRC"
    version: str = "Version 1.0"
    date: str = "Apr 30 2015 00:00:00"
    power_on_event: str = POWER_ON_TRIGGER
    power_on_fail_target: FailTarget = FailTarget.WAIT
    initialize_ticks: int = 1
    power_on_ticks: int = 30
    power_on_timeout_ticks: int = 300
    button_off_ticks: int = 50
    forced_off_ticks: int = 10
    fault_hold_ticks: int = 10
    buffer_bytes: int = 256
    overtime: bool = True
    vehicle: bool = False
    battery_wh: int = 1_200

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range."""
        names = (POWER_ON_TRIGGER, RrcEvent.POWER_ON.value)
        if self.power_on_event not in names:
            raise ValueError(f"power-on event {self.power_on_event!r} is not one of {names}")
        for name in (
            *("initialize_ticks", "power_on_ticks", "power_on_timeout_ticks"),
            *("button_off_ticks", "forced_off_ticks", "fault_hold_ticks", "buffer_bytes"),
            "battery_wh",
        ):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}, at least 1 is needed")


# The settings that Initialize wipes: the settings of commands and buttons.

_NO_LIMIT_YET: Final = Limit(0, 0, 0, 0, 0)
_NO_OUTPUT_YET: Final = Output(0, 0)
_PLAIN_STICK: Final = Joystick()


@dataclass(slots=True)
class Settings:
    """Settings of the RRC, which Initialize resets to their defaults (RRC manual, notes).

    Attributes:
        stable: whether stablemode is on: CHECK is required, and OK is omitted.
        status: whether SA lines are sent.
        watchdog_ticks: time without a correct command after which VR2 is stopped, or 0 for never.
        speed_mode: speed mode from 1 (slowest) to 5.
        speed_locked: whether the speed buttons of the controller have no effect.
        limit: limits of limit mode.
        output: values of output mode.
        joystick: parameters of the stick shaping.
        button_mode: reverse mode that the buttons chose in Standby, or None if the stick does not
            drive in Standby.
        speed_up_count: counter of the speed-up button in SA, 0..15. The counter is odd while the
            button is pressed.
        speed_down_count: counter of the speed-down button in SA, 0..15. The counter is odd while
            the button is pressed.
        alarm_count: counter of the alarm button in SA, 0..15. The counter is odd while the button
            is pressed.
    """

    stable: bool = False
    status: bool = False
    watchdog_ticks: int = 0
    speed_mode: int = 1
    speed_locked: bool = False
    limit: Limit = _NO_LIMIT_YET
    output: Output = _NO_OUTPUT_YET
    joystick: Joystick = _PLAIN_STICK
    button_mode: int | None = None
    speed_up_count: int = 0
    speed_down_count: int = 0
    alarm_count: int = 0

    def store(self, command: Command) -> None:
        """Apply the settings of a command."""
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
