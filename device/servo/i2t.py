"""What protects a power stage from too much current for too long."""

from __future__ import annotations

from tickrig.device.servo.parameters import PowerStage


class I2t:
    """The I2t protection of a power stage.

    A budget of (peak^2 - continuous^2) * time fills by the square of the
    current above the continuous one and drains by it below. Once full, only
    the continuous current is allowed, until the budget is empty again.

    Attributes:
        filled_a2s: how much of the budget is used.
        reduced: only the continuous current is allowed.
    """

    __slots__ = ("_budget_a2s", "_continuous_a2", "_stage", "filled_a2s", "reduced")

    def __init__(self, stage: PowerStage) -> None:
        self._stage = stage
        self._continuous_a2 = stage.continuous_a**2
        self._budget_a2s = (stage.peak_a**2 - self._continuous_a2) * stage.peak_s
        self.filled_a2s, self.reduced = 0.0, False

    @property
    def limit_a(self) -> float:
        """Current that is allowed now."""
        return self._stage.continuous_a if self.reduced else self._stage.peak_a

    def pass_time(self, seconds: float, square_a2s: float) -> None:
        """Let time pass with an integral of the squared current."""
        filled = self.filled_a2s + square_a2s - self._continuous_a2 * seconds
        self.filled_a2s = min(max(filled, 0.0), self._budget_a2s)
        if self.filled_a2s == 0.0:
            self.reduced = False
        elif self.filled_a2s == self._budget_a2s:
            self.reduced = True

    def settled(self, current_a: float) -> bool:
        """Return whether a constant current changes nothing any more."""
        rate = current_a**2 - self._continuous_a2
        if rate < 0.0:
            return self.filled_a2s == 0.0 and not self.reduced
        return rate == 0.0 or self.reduced
