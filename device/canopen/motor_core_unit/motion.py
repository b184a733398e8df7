"""What the motor core unit lets its motor do: the modes of 2000h, and braking."""

from __future__ import annotations

from enum import Enum, IntEnum, auto
from typing import Final, assert_never

from tickrig.device.canopen.motor_core_unit.references import References
from tickrig.device.canopen.motor_core_unit.shaft import Shaft
from tickrig.device.canopen.motor_core_unit.trajectory import CONTROL_US, DEGREE, Trajectory


class Mode(IntEnum):
    """Mode as 2000h has it."""

    FREE = 0
    CURRENT = 1
    VELOCITY = 2
    ANGLE = 3


class Act(Enum):
    """What the motor does."""

    COAST = auto()  # without power
    PUSH = auto()  # current follows the reference
    TURN = auto()  # velocity follows the reference
    POINT = auto()  # angle follows the reference
    BRAKE = auto()  # velocity goes to zero


ACTS: Final = {
    Mode.FREE: Act.COAST,
    Mode.CURRENT: Act.PUSH,
    Mode.VELOCITY: Act.TURN,
    Mode.ANGLE: Act.POINT,
}
"""What a mode does where references act."""

ASTRAY_DEG: Final = 1.0
ASTRAY_DEG_S: Final = 10.0
ASTRAY_MA: Final = 200

LOOPS: Final = (Act.TURN, Act.POINT, Act.BRAKE)
"""The velocity is planned."""


class Motion:
    """Plans one control tick after the other, and gives it to the motor ms by ms.

    Whatever begins goes on from the motion that is: the planned velocity if there
    is one, or else the measured one, the measured angle, the present current.

    Args:
        shaft: the motor behind its gear.
        references: where it shall go.

    Attributes:
        act: what the motor does.
        reached: the reference is reached.
    """

    def __init__(self, shaft: Shaft, references: References) -> None:
        self._shaft, self._references = shaft, references
        self._trajectory = Trajectory()
        self.act, self.reached = Act.COAST, False
        self._begin_ma = self._end_ma = 0

    @property
    def on(self) -> bool:
        """Whether the power stage is on."""
        return self.act is not Act.COAST

    @property
    def loops(self) -> bool:
        """Whether a velocity is to be kept."""
        return self.act in LOOPS

    @property
    def steady(self) -> bool:
        """Whether the next control tick would be as this one."""
        trajectory = self._trajectory
        stands = trajectory.begin_udeg_s == trajectory.velocity_udeg_s == 0
        return stands and self._begin_ma == self._end_ma

    def astray(self, since_us: int) -> bool:
        """Say whether the motor is far from what is wanted of it now."""
        position_deg, velocity_deg_s, _ = self._trajectory.at(since_us)
        match self.act:
            case Act.COAST:
                return False
            case Act.PUSH:
                return abs(self._shaft.current_ma - self._end_ma) > ASTRAY_MA
            case Act.POINT:
                return abs(self._shaft.angle_ndeg / DEGREE - position_deg) > ASTRAY_DEG
            case Act.TURN | Act.BRAKE:
                return abs(self._shaft.velocity_udeg_s / 1e6 - velocity_deg_s) > ASTRAY_DEG_S
            case _:
                assert_never(self.act)

    def plan(self, act: Act) -> None:
        """Plan the control tick that begins."""
        if act is not self.act:
            self._begin(act)
        match act:
            case Act.COAST:
                self.reached = False
            case Act.PUSH:
                self._begin_ma, self._end_ma = self._end_ma, self._references.current_ma
                self.reached = self._begin_ma == self._end_ma
            case Act.TURN:
                self._run(self._references.velocity_udeg_s)
            case Act.POINT:
                self._approach()
            case Act.BRAKE:
                self._run(0)
                self.reached = False
            case _:
                assert_never(act)

    def drive(self, since_us: int) -> None:
        """Tell the motor what to do until the next ms.

        Args:
            since_us: since the begin of the control tick.
        """
        position_deg, velocity_deg_s, acceleration_deg_s2 = self._trajectory.at(since_us)
        match self.act:
            case Act.COAST:
                self._shaft.release()
            case Act.PUSH:
                change_ma = (self._end_ma - self._begin_ma) * since_us / CONTROL_US
                self._shaft.push((self._begin_ma + change_ma) / 1_000)
            case Act.POINT:
                self._shaft.point(position_deg, velocity_deg_s, acceleration_deg_s2)
            case Act.TURN | Act.BRAKE:
                self._shaft.turn(velocity_deg_s, acceleration_deg_s2)
            case _:
                assert_never(self.act)

    def _begin(self, act: Act) -> None:
        """Go on from the motion that is."""
        shaft, trajectory = self._shaft, self._trajectory
        velocity = trajectory.velocity_udeg_s if self.loops else shaft.velocity_udeg_s
        current_ma = shaft.current_ma
        self.act = act
        trajectory.place(shaft.angle_ndeg, velocity if self.loops else 0)
        self._end_ma = current_ma if act is Act.PUSH else 0
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
