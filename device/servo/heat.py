"""How warm and how overloaded a servo is, and what current that leaves."""

from __future__ import annotations

from typing import Final

from tickrig.device.servo.parameters import PowerStage, ServoParameters
from tickrig.device.servo.thermal import Temperatures, ThermalModel
from tickrig.device.twin import Part


class I2t(Part):
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


DERATING_K: Final = 15.0  # the limit falls to 0 over these last kelvins below the hottest


def derated_a(limit_a: float, winding_c: float, winding_max_c: float) -> float:
    """Return what is left of a current limit at a temperature of the winding.

    >>> [derated_a(10.0, winding_c, 125.0) for winding_c in (110.0, 119.0, 125.0)]
    [10.0, 4.0, 0.0]
    """
    left = (winding_max_c - winding_c) / DERATING_K
    return limit_a * min(max(left, 0.0), 1.0)


AGES_S: Final = 1e9  # after this all temperatures stand still


class Heat(Part):
    """Temperatures and I2t budget of a servo, from the squared current.

    Attributes:
        since_us: the instant at which they were worked out.
        temperatures: temperatures at that instant.
        ambient_c: temperature of the air since then.
        i2t: the overload of the power stage.
    """

    __slots__ = ("_thermal", "_winding_max_c", "ambient_c", "i2t", "since_us", "temperatures")

    def __init__(self, parameters: ServoParameters, ambient_c: float) -> None:
        self._thermal, self.i2t = ThermalModel(parameters.motor), I2t(parameters.stage)
        self._winding_max_c = parameters.motor.winding_max_c
        self.since_us, self.ambient_c = 0, ambient_c
        self.temperatures: Temperatures = (ambient_c, ambient_c)

    @property
    def limit_a(self) -> float:
        """Current that may flow now."""
        return self._limit_at(self.temperatures[0])

    @property
    def resistance_ohm(self) -> float:
        """Resistance of the winding."""
        return self._thermal.resistance_ohm(self.temperatures[0])

    def pass_time(self, now_us: int, square_a2s: float) -> None:
        """Let time pass with an integral of the squared current, A^2 s."""
        seconds = (now_us - self.since_us) / 1_000_000
        if seconds:
            self.i2t.pass_time(seconds, square_a2s)
            self.temperatures = self._after(seconds, square_a2s / seconds)
            self.since_us = now_us

    def rest(self, now_us: int, current_a: float) -> None:
        """Let time pass with a constant current; the temperatures are those of `at`, to the bit."""
        seconds = (now_us - self.since_us) / 1_000_000
        self.i2t.pass_time(seconds, current_a**2 * seconds)
        self.temperatures, self.since_us = self.at(now_us, current_a), now_us

    def at(self, now_us: int, current_a: float) -> Temperatures:
        """Return the temperatures at an instant, the current constant until then."""
        return self._after((now_us - self.since_us) / 1_000_000, current_a**2)

    def bears(self, current_a: float) -> bool:
        """Return whether a current may flow for ever and changes no limit."""
        last, _ = self._after(AGES_S, current_a**2)
        hottest = max(last, self.temperatures[0])
        return self.i2t.settled(current_a) and abs(current_a) <= self._limit_at(hottest)

    def _after(self, seconds: float, square_a2: float) -> Temperatures:
        return self._thermal.after(self.temperatures, seconds, square_a2, self.ambient_c)

    def _limit_at(self, winding_c: float) -> float:
        return derated_a(self.i2t.limit_a, winding_c, self._winding_max_c)
