"""What the motor core unit lets its motor do: the modes of 2000h, and braking."""

from __future__ import annotations

from enum import Enum, IntEnum, IntFlag, auto
from typing import Final, assert_never

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.motor_core_unit.objects import References
from tickrig.device.canopen.motor_core_unit.shaft import Shaft
from tickrig.device.canopen.motor_core_unit.trajectory import CONTROL_US, DEGREE, Trajectory
from tickrig.device.twin import Part


class Mode(IntEnum):
    """Mode as 2000h has it."""

    FREE = 0
    CURRENT = 1
    VELOCITY = 2
    ANGLE = 3


class Action(Enum):
    """What the motor does."""

    COAST = auto()  # without power
    PUSH = auto()  # current follows the reference
    TURN = auto()  # velocity follows the reference
    POINT = auto()  # angle follows the reference
    BRAKE = auto()  # velocity goes to zero


ACTIONS: Final = {
    Mode.FREE: Action.COAST,
    Mode.CURRENT: Action.PUSH,
    Mode.VELOCITY: Action.TURN,
    Mode.ANGLE: Action.POINT,
}
"""What a mode does where references act."""

DEVIATION_DEG: Final = 1.0
DEVIATION_DEG_S: Final = 10.0
DEVIATION_MA: Final = 200

LOOPS: Final = (Action.TURN, Action.POINT, Action.BRAKE)
"""The velocity is planned."""


class Motion(Part):
    """Plans one control tick after the other, and gives it to the motor ms by ms.

    Whatever begins goes on from the motion that is: the planned velocity if there
    is one, or else the measured one, the measured angle, the present current.

    Args:
        shaft: the motor behind its gear.
        references: where it shall go.

    Attributes:
        action: what the motor does.
        reached: the planned motion has ended at the reference, and the motor is there.
    """

    def __init__(self, shaft: Shaft, references: References) -> None:
        self._shaft, self._references = shaft, references
        self._trajectory = Trajectory()
        self.action, self.reached = Action.COAST, False
        self._begin_ma = self._end_ma = 0

    @property
    def on(self) -> bool:
        """Whether the power stage is on."""
        return self.action is not Action.COAST

    @property
    def loops(self) -> bool:
        """Whether a velocity is to be kept."""
        return self.action in LOOPS

    @property
    def steady(self) -> bool:
        """Whether the next control tick would be as this one."""
        trajectory = self._trajectory
        stands = trajectory.begin_udeg_s == trajectory.velocity_udeg_s == 0
        return stands and self._begin_ma == self._end_ma

    def deviates(self, since_us: int) -> bool:
        """Return whether the motor is far from what is wanted of it now."""
        position_deg, velocity_deg_s, _ = self._trajectory.at(since_us)
        match self.action:
            case Action.COAST:
                return False
            case Action.PUSH:
                return abs(self._shaft.current_ma - self._end_ma) > DEVIATION_MA
            case Action.POINT:
                return abs(self._shaft.angle_ndeg / DEGREE - position_deg) > DEVIATION_DEG
            case Action.TURN | Action.BRAKE:
                return abs(self._shaft.velocity_udeg_s / 1e6 - velocity_deg_s) > DEVIATION_DEG_S
            case _:
                assert_never(self.action)

    def plan(self, action: Action) -> None:
        """Plan the control tick that begins."""
        if action is not self.action:
            self._begin(action)
        match action:
            case Action.COAST:
                self.reached = False
            case Action.PUSH:
                self._begin_ma, self._end_ma = self._end_ma, self._references.current_ma
                self.reached = self._begin_ma == self._end_ma
            case Action.TURN:
                self._run(self._references.velocity_udeg_s)
            case Action.POINT:
                self._approach()
            case Action.BRAKE:
                self._run(0)
                self.reached = False
            case _:
                assert_never(action)
        self.reached = self.reached and not self.deviates(0)

    def drive(self, since_us: int) -> None:
        """Command the motor until the next ms.

        Args:
            since_us: since the begin of the control tick.
        """
        position_deg, velocity_deg_s, acceleration_deg_s2 = self._trajectory.at(since_us)
        match self.action:
            case Action.COAST:
                self._shaft.release()
            case Action.PUSH:
                change_ma = (self._end_ma - self._begin_ma) * since_us / CONTROL_US
                self._shaft.push((self._begin_ma + change_ma) / 1_000)
            case Action.POINT:
                self._shaft.point(position_deg, velocity_deg_s, acceleration_deg_s2)
            case Action.TURN | Action.BRAKE:
                self._shaft.turn(velocity_deg_s, acceleration_deg_s2)
            case _:
                assert_never(self.action)

    def _begin(self, action: Action) -> None:
        """Go on from the motion that is."""
        shaft, trajectory = self._shaft, self._trajectory
        velocity = trajectory.velocity_udeg_s if self.loops else shaft.velocity_udeg_s
        current_ma = shaft.current_ma
        self.action = action
        trajectory.place(shaft.angle_ndeg, velocity if self.loops else 0)
        self._end_ma = current_ma if action is Action.PUSH else 0
        self._begin_ma = self._end_ma

    def _run(self, velocity_udeg_s: int) -> None:
        self._trajectory.run(velocity_udeg_s)
        self.reached = self._trajectory.begin_udeg_s == velocity_udeg_s

    def _approach(self) -> None:
        target_ndeg = self._references.target_ndeg
        trajectory = self._trajectory
        trajectory.approach(target_ndeg, self._references.velocity_limit_udeg_s)
        self.reached = trajectory.begin_ndeg == target_ndeg and not trajectory.begin_udeg_s


def mode_of(number: int) -> Mode:
    """Return what 2000h stands for; a number that it does not take is no mode.

    >>> mode_of(3).name, mode_of(4).name
    ('ANGLE', 'FREE')
    """
    return Mode(number) if number in tuple(Mode) else Mode.FREE


STATUS: Final = 0x2001
MEASURED: Final = 0x6401


class Status(IntFlag):
    """Bits of 2001h (DECISION K19)."""

    ON = 1
    REACHED = 2
    LIMITED = 4
    FAULT = 8


class Display(Part):
    """Writes 2001h and 6401h, once a control tick.

    Args:
        dictionary: of the unit.
        shaft: what is measured.
        references: they know the full scales.
    """

    def __init__(self, dictionary: Dictionary, shaft: Shaft, references: References) -> None:
        self._status = dictionary[STATUS, 0]
        self._angle, self._velocity, self._current, self._supply = dictionary.elements(MEASURED)
        self._shaft, self._references = shaft, references

    def show(self, motion: Motion, *, faulty: bool) -> None:
        """Show what is."""
        shaft, references = self._shaft, self._references
        self._angle.value = references.angle(shaft.angle_ndeg / 1e6)
        self._velocity.value = references.velocity(shaft.velocity_udeg_s / 1e3)
        self._current.value = references.current(shaft.current_ma)
        self._supply.value = shaft.servo.supply_mv // 10
        self._status.value = self._bits(motion, faulty=faulty)

    def _bits(self, motion: Motion, *, faulty: bool) -> int:
        status = Status.FAULT if faulty else Status(0)
        if motion.on:
            status |= Status.ON
            if motion.reached:
                status |= Status.REACHED
            if self._shaft.servo.current_limited:
                status |= Status.LIMITED
        return int(status)
