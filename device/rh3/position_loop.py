"""The way to a target position: a speed from which the ramp can stop there."""

from __future__ import annotations

from math import copysign, sqrt
from typing import Final

from tickrig.device.modbus.registers import Registers

DEADBAND: Final = 1
"""Counts that are near enough."""


class PositionLoop:
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
