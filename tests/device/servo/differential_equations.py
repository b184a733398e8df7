"""Winding and shaft integrated in small steps: a second, naive model."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.servo.parameters import MotorParameters

State = tuple[float, float, float, float]  # current, speed, angle, integral of current^2
PARTS = 400  # Runge-Kutta steps in a control step


@dataclass(frozen=True, slots=True)
class Equations:
    """A motor that turns one way under constant voltage and torque."""

    motor: MotorParameters
    inertia_kg_m2: float
    voltage_v: float
    torque_nm: float

    def slope(self, state: State) -> State:
        i, w, _, _ = state
        motor = self.motor
        k = motor.torque_constant_nm_a
        di = (self.voltage_v - motor.resistance_ohm * i - k * w) / motor.inductance_h
        dw = (k * i - motor.viscous_nm_s * w + self.torque_nm) / self.inertia_kg_m2
        return di, dw, w, i * i

    def after(self, state: State, seconds: float) -> State:
        h = seconds / PARTS
        for _ in range(PARTS):
            a = self.slope(state)
            b = self.slope(along(state, a, h / 2))
            c = self.slope(along(state, b, h / 2))
            d = self.slope(along(state, c, h))
            mean = zip(a, b, c, d, strict=True)
            state = along(state, [(p + 2 * q + 2 * r + s) / 6 for p, q, r, s in mean], h)
        return state


def along(state: State, slope: list[float] | State, h: float) -> State:
    i, w, x, q = (value + h * rate for value, rate in zip(state, slope, strict=True))
    return i, w, x, q
