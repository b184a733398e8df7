"""The heat of a motor: winding and housing as two thermal nodes."""

from __future__ import annotations

from math import expm1, sqrt
from typing import Final

from tickrig.device.servo.parameters import MotorParameters
from tickrig.device.twin import Part

COPPER_PER_K: Final = 0.0039  # growth of the resistance of copper, of its value at 25 degC
HOTTEST_C: Final = 1_000.0  # no motor is left beyond this, and no model


Temperatures = tuple[float, float]
"""Of the winding and the housing of a motor, degC."""


class ThermalModel(Part):
    """Winding and housing, heated by the current in the winding.

    The heat is R I^2, and R grows with the temperature, which keeps the
    system linear: its state at any later time is a closed form. Not modelled:
    heat of friction and iron, the gear, the power stage, air that moves.
    """

    __slots__ = ("_capacities", "_motor")

    def __init__(self, motor: MotorParameters) -> None:
        self._motor = motor
        self._capacities = (
            motor.winding_s / motor.winding_housing_k_w,
            motor.housing_s / motor.housing_ambient_k_w,
        )

    def resistance_ohm(self, winding_c: float) -> float:
        """Return the resistance of the winding at a temperature."""
        return self._motor.resistance_ohm * (1 + COPPER_PER_K * (winding_c - 25.0))

    def after(
        self, start: Temperatures, seconds: float, square_a2: float, ambient_c: float
    ) -> Temperatures:
        """Return the temperatures some time later.

        Args:
            start: temperatures now.
            seconds: how much later, 0 or more.
            square_a2: mean square of the current meanwhile, A^2.
            ambient_c: temperature of the air.
        """
        motor, (winding, housing), (winding_c, housing_c) = self._motor, self._capacities, start
        slope = motor.resistance_ohm * COPPER_PER_K * square_a2
        across, out = 1 / motor.winding_housing_k_w, 1 / motor.housing_ambient_k_w
        a, b = (slope - across) / winding, across / winding
        c, d = across / housing, -(across + out) / housing
        # rates of change now, then each mode of the system grows or fades by itself
        flow = across * (winding_c - housing_c)
        heat = square_a2 * self.resistance_ohm(winding_c)
        dw = (heat - flow) / winding
        dh = (flow - out * (housing_c - ambient_c)) / housing
        middle, spread = (a + d) / 2, sqrt(((a - d) / 2) ** 2 + b * c)
        slow, fast = _span(middle + spread, seconds), _span(middle - spread, seconds)
        mean, half = (slow + fast) / 2, (slow - fast) / (2 * spread)
        tilt = (a - d) / 2
        return (
            min(winding_c + mean * dw + half * (tilt * dw + b * dh), HOTTEST_C),
            min(housing_c + mean * dh + half * (c * dw - tilt * dh), HOTTEST_C),
        )


def _span(rate: float, seconds: float) -> float:
    """Return the integral of e^(rate t) over a time."""
    return expm1(min(rate * seconds, 50.0)) / rate if rate else seconds
