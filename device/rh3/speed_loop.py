"""The servo of a wheel: a ramp for the target and a PID loop, each millisecond."""

from __future__ import annotations

from math import copysign
from typing import Final

from tickrig.device.modbus.registers import Registers
from tickrig.device.rh3.parameters import PER_MILLE

INTEGRAL_LIMIT: Final = 10_000.0
"""Counts that the integral holds at most; a choice."""


class SpeedLoop:
    """A PID loop on the counts of each millisecond (rh3-control, wheel servo).

    Torque in per mille = VP e + VI sum(e) + VD delta(e), with e in counts/ms, cut to the
    rated torque; friction is made up for while the target moves.

    Args:
        registers: where its gains and limits are.
        friction: torque to be made up for, per mille.

    Attributes:
        reference: the target behind its ramp, counts/ms.
        torque: of the latest step, per mille.
    """

    def __init__(self, registers: Registers, friction: float) -> None:
        self._registers, self._friction = registers, friction
        self.take_over(0.0)

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
        registers = self._registers
        most = registers["acceleration_limit"] / 1e6
        self.reference += min(max(target - self.reference, -most), most)
        error = self.reference - counted
        self._sum = min(max(self._sum + error, -INTEGRAL_LIMIT), INTEGRAL_LIMIT)
        torque = (
            registers["gain_vp"] * error
            + registers["gain_vi"] * self._sum
            + registers["gain_vd"] * (error - self._error)
        )
        self._error = error
        if self.reference:
            torque += copysign(self._friction, self.reference)
        self.torque = min(max(torque, -PER_MILLE), PER_MILLE)
        return self.torque
