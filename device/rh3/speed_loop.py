"""The servo of a wheel: ramp and PID loop of its speed, and the way to a position."""

from __future__ import annotations

from math import copysign, floor, sqrt
from typing import Final

from tickrig.device.modbus.registers import Registers
from tickrig.device.rh3.parameters import PER_MILLE
from tickrig.device.rh3.wheel import SLOW, Wheel
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

    Attributes:
        reference: the target behind its ramp, counts/ms.
        torque: of the latest millisecond, per mille.
        limit: the highest speed, counts/ms.
        counted: counts of the latest millisecond.
        stalled_ms: for how long full torque has turned nothing.
    """

    def __init__(self, registers: Registers) -> None:
        self.counted = self.stalled_ms = 0
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
        self._sum = self._error = self._change = 0.0

    @property
    def settled(self) -> bool:
        """Whether a step towards standstill, with nothing counted, would change nothing."""
        return not (self.reference or self._error or self._change or self.counted)

    def drive(self, wheel: Wheel, target: float, steps: int) -> list[float]:
        """Turn a wheel for some milliseconds; return its speed in each, counts/ms.

        Args:
            wheel: with what the world does to it.
            target: counts/ms.
            steps: how many milliseconds.
        """
        # one loop over locals takes half the time of a call for each part
        vp, vi, vd, ramp = self._vp, self._vi, self._vd, self._ramp
        load, jammed, friction, agility = wheel.load, wheel.jammed, wheel.friction, wheel.agility
        reference, before, change, torque = self.reference, self._error, self._change, self.torque
        counted, stalled_ms = self.counted, self.stalled_ms
        speed, travel, counts = wheel.speed, wheel.travel, wheel.counts
        speeds: list[float] = []
        for _ in range(steps):
            if target > reference + ramp:
                reference += ramp
            elif target < reference - ramp:
                reference -= ramp
            else:
                reference = target
            error = reference - counted
            change, before = error - before, error
            torque = vp * error + vd * change
            if vi:
                self._sum = min(max(self._sum + error, -INTEGRAL_LIMIT), INTEGRAL_LIMIT)
                torque += vi * self._sum
            if reference:
                torque += friction if reference > 0 else -friction
            if not -PER_MILLE <= torque <= PER_MILLE:
                torque = copysign(PER_MILLE, torque)
            net, counted = torque - load, 0
            if jammed or (-SLOW < speed < SLOW and -friction <= net <= friction):
                speed = 0.0
            else:
                speed += (net - (friction if (speed or net) > 0 else -friction)) * agility
                travel += speed
                counted, counts = floor(travel) - counts, floor(travel)
            stalled_ms = 0 if counted or abs(torque) < PER_MILLE else stalled_ms + 1
            speeds.append(speed)
        self.reference, self._error, self._change, self.torque = reference, before, change, torque
        self.counted, self.stalled_ms = counted, stalled_ms
        wheel.speed, wheel.travel = speed, travel
        return speeds
