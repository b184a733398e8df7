"""The velocity and position loops of a drive."""

from __future__ import annotations

from math import copysign, pi

from tickrig.device.servo.discretisation import STEP_S
from tickrig.device.servo.parameters import ServoParameters
from tickrig.device.twin import Part


class Loops(Part):
    """A position loop around a velocity loop, in control steps of 1 ms.

    Position: proportional, in whole counts; an error below one count counts as
    none while the demand stands still. Velocity: proportional and integral.
    Acceleration, viscous and dry friction are fed forward. While the demand
    of current is cut, the integral does not grow further that way.

    Attributes:
        integral_a: what the integral adds to the current.
        cut: direction in which the latest demand was cut: -1, 0, 1.
    """

    __slots__ = (
        "_accelerate",
        "_dry",
        "_integral",
        "_position",
        "_proportional",
        "_rad",
        "_viscous",
        "cut",
        "integral_a",
    )

    def __init__(self, parameters: ServoParameters) -> None:
        gains, motor = parameters.gains, parameters.motor
        k, natural = motor.torque_constant_nm_a, gains.velocity_rad_s
        self._rad = 2 * pi / parameters.encoders.counts_per_turn
        self._accelerate = parameters.inertia_kg_m2 / k
        self._dry, self._viscous = parameters.coulomb_nm / k, motor.viscous_nm_s / k
        self._proportional = 2 * gains.damping * natural * self._accelerate
        self._integral = natural**2 * self._accelerate * STEP_S
        self._position = gains.position_rad_s
        self.integral_a, self.cut = 0.0, 0

    @property
    def gains(self) -> tuple[float, float, float, float, float, float]:
        """For `RunAhead`: rad a count; gains of position, integral, error, speed, friction."""
        proportional, viscous, dry = self._proportional, self._viscous, self._dry
        return self._rad, self._position, self._integral, proportional, viscous, dry

    def follow(
        self, position: float, counts: int, velocity: float, acceleration: float, speed: float
    ) -> float:
        """Return the current that a demanded position asks for, A."""
        error = position - counts
        if velocity == 0.0 and -1.0 < error < 1.0:
            error = 0.0
        return self.turn(velocity + self._position * error, acceleration, speed)

    def turn(self, velocity: float, acceleration: float, speed: float) -> float:
        """Return the current that a demanded velocity asks for, A.

        Args:
            velocity: demand, counts/s.
            acceleration: demand, counts/s^2.
            speed: measured speed of the motor, rad/s.
        """
        wanted = velocity * self._rad
        error = wanted - speed
        if error * self.cut <= 0.0:
            self.integral_a += self._integral * error
        current = self.integral_a + self._proportional * error + self._viscous * wanted
        if wanted != 0.0:
            current += copysign(self._dry, wanted)
        return current + self._accelerate * self._rad * acceleration
