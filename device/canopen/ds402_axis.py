"""An axis that follows what its drive tells it: whole numbers, one step a millisecond."""

from __future__ import annotations

from math import isqrt
from typing import Final

MICRO: Final = 1_000_000
I32_SPAN: Final = 1 << 32
I32_HALF: Final = 1 << 31


class Axis:
    """Position and velocity of an ideal motor.

    Not emulated: load, following error, jerk, limit switches.

    Attributes:
        milli_velocity: thousandths of an increment per second.
    """

    __slots__ = ("_micro", "milli_velocity")

    def __init__(self) -> None:
        self._micro = self.milli_velocity = 0

    @property
    def position(self) -> int:
        """Increments, as an INTEGER32 that wraps."""
        return ((self._micro + MICRO // 2) // MICRO + I32_HALF) % I32_SPAN - I32_HALF

    @property
    def velocity(self) -> int:
        """Increments per second, as far as an INTEGER32 holds them."""
        whole = min(abs(self.milli_velocity) // 1_000, I32_HALF - 1)
        return whole if self.milli_velocity >= 0 else -whole

    @property
    def stands(self) -> bool:
        """Whether it does not move."""
        return self.milli_velocity == 0

    def place(self, position: int) -> None:
        """Be at a position without a motion."""
        self._micro, self.milli_velocity = position * MICRO, 0

    def halt(self) -> None:
        """Stand still at once."""
        self.milli_velocity = 0

    def move(self, velocity: int) -> None:
        """Make a step with a velocity in increments per second."""
        self.milli_velocity = velocity * 1_000
        self._micro += self.milli_velocity

    def run(self, velocity: int, acceleration: int) -> bool:
        """Make a step towards a velocity; say whether it is reached.

        Args:
            velocity: increments per second.
            acceleration: increments per second per second, positive.
        """
        wanted = velocity * 1_000
        self._step(wanted, acceleration)
        return self.milli_velocity == wanted

    def approach(self, target: int, velocity: int, acceleration: int) -> bool:
        """Make a step towards a position, so that it stops there; say whether it is reached."""
        distance = target * MICRO - self._micro
        if abs(distance) <= acceleration and abs(self.milli_velocity) <= 2 * acceleration:
            self.place(target)
            return True
        stopping = (isqrt(acceleration**2 + 8 * acceleration * abs(distance)) - acceleration) // 2
        wanted = min(velocity * 1_000, stopping)
        self._step(wanted if distance > 0 else -wanted, acceleration)
        return False

    def _step(self, wanted: int, acceleration: int) -> None:
        change = max(-acceleration, min(acceleration, wanted - self.milli_velocity))
        self.milli_velocity += change
        self._micro += self.milli_velocity
