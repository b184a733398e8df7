"""Winding, shaft and friction of a servo, in control steps of 1 ms."""

from __future__ import annotations

from math import exp, pi

from tickrig.device.servo.discretisation import STEP_S, coast, discretise
from tickrig.device.servo.parameters import ServoParameters

BREAKAWAY = 1.02  # static friction by dry friction; it ends a creep, and makes no jump


class Plant:
    """The electro-mechanical part of a servo, at the motor shaft.

    Dry friction is a torque within bounds that is as large as it must be to
    stop the shaft in this step, if the bounds allow (time stepping after
    Moreau). So there is no chatter, and a shaft at rest is at rest exactly.
    The current follows its demand within a step, as long as the voltage
    allows. Not modelled: PWM ripple, cogging, a breakaway torque above the
    dry friction, play and elasticity, the loss of the gear on its inertia.

    Attributes:
        current_a: current in the winding.
        speed_rad_s: speed of the motor.
        position: angle of the motor, counts.
        blocked: the shaft is held.
        load_nm: external torque at the motor shaft, before the gear's loss.
        friction_nm: bounds of the friction, backward and forward.
        square_a2s: integral of the squared current.
        electrical_j: energy that came out of the power stage.
        copper_j: heat of the winding.
        friction_j: heat of friction and gear, and of a shaft that was held.
        resistance_ohm: present resistance of the winding.
        inertia_kg_m2: present inertia at the motor shaft.
    """

    __slots__ = (
        "_coasting",
        "_coulomb_nm",
        "_counts_per_rad",
        "_held",
        "_motor",
        "_step",
        "blocked",
        "copper_j",
        "current_a",
        "electrical_j",
        "friction_j",
        "friction_nm",
        "inertia_kg_m2",
        "load_nm",
        "position",
        "resistance_ohm",
        "speed_rad_s",
        "square_a2s",
    )

    def __init__(self, parameters: ServoParameters) -> None:
        self._motor = parameters.motor
        self._counts_per_rad = parameters.encoders.counts_per_turn / (2 * pi)
        self._coulomb_nm = parameters.coulomb_nm
        self.current_a = self.speed_rad_s = self.position = 0.0
        self.square_a2s = self.electrical_j = self.copper_j = self.friction_j = 0.0
        self.blocked = False
        self.bear(0.0, 1.0)
        self.shape(parameters.inertia_kg_m2, parameters.motor.resistance_ohm)

    def shape(self, inertia_kg_m2: float, resistance_ohm: float) -> None:
        """Take another inertia or resistance; the speed stays."""
        motor = self._motor
        el, b = motor.inductance_h, motor.viscous_nm_s
        self.inertia_kg_m2, self.resistance_ohm = inertia_kg_m2, resistance_ohm
        self._step = discretise(resistance_ohm, el, motor.torque_constant_nm_a, inertia_kg_m2, b)
        self._coasting = coast(inertia_kg_m2, b)
        self._held = exp(-resistance_ohm * STEP_S / el)

    @property
    def velocity_counts_s(self) -> float:
        """Speed of the motor, counts/s."""
        return self.speed_rad_s * self._counts_per_rad

    def bear(self, load_nm: float, efficiency: float) -> None:
        """Take an external torque; the gear takes its part as friction.

        A torque against the motion costs the motor 1 / efficiency of it, one with
        the motion brings it only the part that gets through.
        """
        against, along = abs(load_nm) * (1 / efficiency - 1), abs(load_nm) * (1 - efficiency)
        forward, backward = (along, against) if load_nm > 0 else (against, along)
        self.load_nm = load_nm
        self.friction_nm = (-self._coulomb_nm - forward, self._coulomb_nm + backward)

    def hold(self, blocked: bool) -> None:
        """Hold the shaft, or let it go."""
        if blocked:
            self.friction_j += self.inertia_kg_m2 * self.speed_rad_s**2 / 2
            self.speed_rad_s = 0.0
        self.blocked = blocked

    def open(self) -> None:
        """Let one step pass with the winding open; what current there was dies in the diodes."""
        self.copper_j += self._motor.inductance_h * self.current_a**2 / 2
        self.current_a = 0.0
        if self.speed_rad_s == 0.0 and self._sticks(0.0):
            return
        (s0, s1), (a0, a1) = self._coasting
        w, m = self.speed_rad_s, self.load_nm
        free = s0 * w + s1 * m
        friction, speed = self._rub(free, s1)
        self._turn(speed, a0 * w + a1 * (m + friction), friction)

    def drive(self, current_a: float, limit_v: float) -> int:
        """Let one step pass toward a current; return how the voltage cut it: -1, 0, 1."""
        if self.speed_rad_s == 0.0 and (cut := self._stay(current_a, limit_v)) is not None:
            return cut
        step, i, w, m = self._step, self.current_a, self.speed_rad_s, self.load_nm
        s0, s1, s2, s3 = step.speed
        friction, speed = self._rub(s0 * i + s1 * w + s2 * current_a + s3 * m, s3)
        v0, v1, v2, v3 = step.voltage
        u = v0 * i + v1 * w + v2 * current_a + v3 * (m + friction)
        if -limit_v <= u <= limit_v:
            a0, a1, a2, a3 = step.angle
            way = a0 * i + a1 * w + a2 * current_a + a3 * (m + friction)
            self._carry(current_a, u, way, friction)
            self._turn(speed, way, friction)
            return 0
        cut = 1 if u > 0 else -1
        u = cut * limit_v
        s0, s1, s2, s3 = step.speed_u
        friction, speed = self._rub(s0 * i + s1 * w + s2 * u + s3 * m, s3)
        m += friction
        a0, a1, a2, a3 = step.angle_u
        way = a0 * i + a1 * w + a2 * u + a3 * m
        c0, c1, c2, c3 = step.current_u
        self._carry(c0 * i + c1 * w + c2 * u + c3 * m, u, way, friction)
        self._turn(speed, way, friction)
        return cut

    def _rub(self, free: float, per_nm: float) -> tuple[float, float]:
        """Return the friction, and the speed after a step that would end at `free` without it."""
        low, high = self.friction_nm
        friction = -free / per_nm
        if low * BREAKAWAY <= friction <= high * BREAKAWAY:
            return friction, 0.0
        friction = low if friction < low else high
        return friction, free + per_nm * friction

    def _sticks(self, current_a: float) -> bool:
        """Return whether friction holds the shaft against this current and the load."""
        low, high = self.friction_nm
        friction = -self._motor.torque_constant_nm_a * current_a - self.load_nm
        return low * BREAKAWAY <= friction <= high * BREAKAWAY or self.blocked

    def _stay(self, current_a: float, limit_v: float) -> int | None:
        """Let a step pass at standstill; None if the shaft would not stay."""
        i, r, left = self.current_a, self.resistance_ohm, self._held
        u = r * (current_a - left * i) / (1 - left)
        cut = 0
        if not -limit_v <= u <= limit_v:
            cut = 1 if u > 0 else -1
            u = cut * limit_v
            current_a = left * i + (1 - left) * u / r
        if not (self._sticks(i) and self._sticks(current_a)):
            return None
        el = self._motor.inductance_h
        charge = (u * STEP_S - el * (current_a - i)) / r
        end = u / r
        square = (1 - left * left) * el / (2 * r) * (i - end) ** 2
        square += (2 * charge - end * STEP_S) * end
        self._heat(charge * u, square)
        self.current_a = current_a
        return cut

    def _carry(self, current_a: float, u: float, way: float, friction: float) -> None:
        """Take over the current after a step, and what it heated."""
        motor, i, w, r = self._motor, self.current_a, self.speed_rad_s, self.resistance_ohm
        k, b, m = motor.torque_constant_nm_a, motor.viscous_nm_s, self.load_nm + friction
        charge = (u * STEP_S - motor.inductance_h * (current_a - i) - k * way) / r
        scale = 1 / (r * b + k * k)
        end = (u * b - k * m) * scale
        di, dw = i - end, w - (u * k + r * m) * scale
        q0, q1, q2 = self._step.square
        square = q0 * di * di + q1 * di * dw + q2 * dw * dw + (2 * charge - end * STEP_S) * end
        self._heat(charge * u, square)
        self.current_a = current_a

    def _heat(self, electrical_j: float, square_a2s: float) -> None:
        self.electrical_j += electrical_j
        self.square_a2s += square_a2s
        self.copper_j += self.resistance_ohm * square_a2s

    def _turn(self, speed: float, way: float, friction: float) -> None:
        """Take over speed and angle after a step, and what rubbed."""
        w = self.speed_rad_s
        mean_square = (w * w + w * speed + speed * speed) / 3
        self.friction_j += self._motor.viscous_nm_s * mean_square * STEP_S - friction * way
        self.speed_rad_s = speed
        self.position += way * self._counts_per_rad
