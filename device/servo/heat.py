"""How warm and how overloaded a servo is, and what current that leaves."""

from __future__ import annotations

from tickrig.device.servo.derating import derated_a
from tickrig.device.servo.i2t import I2t
from tickrig.device.servo.parameters import ServoParameters
from tickrig.device.servo.thermal import Temperatures, ThermalModel

AGES_S = 1e9  # after this all temperatures stand still


class Heat:
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
        self.temperatures = Temperatures(ambient_c, ambient_c)

    @property
    def limit_a(self) -> float:
        """Current that may flow now."""
        return self._limit_at(self.temperatures.winding_c)

    @property
    def resistance_ohm(self) -> float:
        """Resistance of the winding."""
        return self._thermal.resistance_ohm(self.temperatures.winding_c)

    def pass_time(self, now_us: int, square_a2s: float) -> None:
        """Let time pass with an integral of the squared current, A^2 s."""
        seconds = (now_us - self.since_us) / 1_000_000
        if seconds:
            self.i2t.pass_time(seconds, square_a2s)
            self.temperatures = self._after(seconds, square_a2s / seconds)
            self.since_us = now_us

    def at(self, now_us: int, current_a: float) -> Temperatures:
        """Return the temperatures at an instant, the current constant until then."""
        return self._after((now_us - self.since_us) / 1_000_000, current_a**2)

    def bears(self, current_a: float) -> bool:
        """Return whether a current may flow for ever and changes no limit."""
        last = self._after(AGES_S, current_a**2).winding_c
        hottest = max(last, self.temperatures.winding_c)
        return self.i2t.settled(current_a) and abs(current_a) <= self._limit_at(hottest)

    def _after(self, seconds: float, square_a2: float) -> Temperatures:
        return self._thermal.after(self.temperatures, seconds, square_a2, self.ambient_c)

    def _limit_at(self, winding_c: float) -> float:
        return derated_a(self.i2t.limit_a, winding_c, self._winding_max_c)
