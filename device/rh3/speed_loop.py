"""The servo of a wheel: ramp and PID loop of its speed, and the way to a position."""

from __future__ import annotations

from math import copysign, sqrt
from typing import Final

from tickrig.device.modbus.registers import Registers
from tickrig.device.rh3.parameters import PER_MILLE
from tickrig.device.twin import Part

DEADBAND: Final = 1
"""Counts that are near enough."""


class PositionLoop(Part):
    """A PID loop from counts to counts/ms, with gains P in 1/s, I in 1/s2, D plain.

    Args:
        registers: where its gains and limits are.
    """

    def __init__(self, registers: Registers) -> None:
        self._registers = registers
        self.begin()

    def begin(self) -> None:
        """Begin anew."""
        self._sum, self._before = 0, 0

    def step(self, error: int) -> float:
        """Return the speed to have for the next millisecond.

        Args:
            error: counts to go.
        """
        if abs(error) <= DEADBAND:
            self.begin()
            return 0.0
        registers = self._registers
        change, self._before = error - self._before, error
        self._sum += error
        wanted = (
            registers["gain_p"] * error / 1e3
            + registers["gain_i"] * self._sum / 1e6
            + registers["gain_d"] * change
        )
        braking = sqrt(2 * registers["acceleration_limit"] / 1e6 * abs(error))
        return copysign(min(abs(wanted), braking), wanted)


INTEGRAL_LIMIT: Final = 10_000.0
"""Counts that the integral holds at most; a choice."""


class SpeedLoop(Part):
    """A PID loop on the counts of each millisecond (rh3-control, wheel servo).

    Torque in per mille = VP e + VI sum(e) + VD delta(e), with e in counts/ms, cut to the
    rated torque; friction is made up for while the target moves.

    Args:
        registers: where its gains and limits are.
        friction: torque to be made up for, per mille.

    Attributes:
        reference: the target behind its ramp, counts/ms.
        torque: of the latest step, per mille.
        limit: the highest speed, counts/ms.
    """

    def __init__(self, registers: Registers, friction: float) -> None:
        self._friction = friction
        self.configure(registers)
        self.take_over(0.0)

    def configure(self, registers: Registers) -> None:
        """Take over gains and limits."""
        self._vp, self._vi, self._vd = (registers[f"gain_v{gain}"] for gain in "pid")
        self._ramp = registers["acceleration_limit"] / 1e6
        self.limit = registers["speed_limit"] / 1e3

    def take_over(self, speed: float) -> None:
        """Begin anew at a speed, so that nothing jerks."""
        self.reference, self.torque = speed, 0.0
        self._sum = self._error = 0.0

    @property
    def settled(self) -> bool:
        """Whether a step towards standstill, with nothing counted, would change nothing."""
        return not (self.reference or self._error)

    def step(self, target: float, counted: int) -> float:
        """Return the torque for the next millisecond.

        Args:
            target: counts/ms.
            counted: counts of the latest millisecond.
        """
        reference, ramp = self.reference, self._ramp
        if target != reference:
            if target > reference + ramp:
                target = reference + ramp
            elif target < reference - ramp:
                target = reference - ramp
            self.reference = reference = target
        error = reference - counted
        torque = self._vp * error + self._vd * (error - self._error)
        if self._vi:
            self._sum = min(max(self._sum + error, -INTEGRAL_LIMIT), INTEGRAL_LIMIT)
            torque += self._vi * self._sum
        self._error = error
        if reference:
            torque += copysign(self._friction, reference)
        if not -PER_MILLE <= torque <= PER_MILLE:
            torque = copysign(PER_MILLE, torque)
        self.torque = torque
        return torque
