"""Winding, shaft and friction of a servo, in control steps of 1 ms."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, reduce
from math import exp, pi
from typing import Final

from tickrig.device.servo.parameters import MotorParameters, ServoParameters
from tickrig.device.twin import Immutable, Part

# The exact answer of winding and shaft to one control step.
#
#     L di/dt = u - R i - k w
#     J dw/dt = k i - b w + m        m: torque of load and friction
#
# These equations are linear, so the state after a step is a matrix times the state before it. The
# current regulator is much faster than a step. If the voltage allows, it leads the current on a
# straight line to its demand; otherwise the voltage is constant. The matrices come from
# exponentials of the two systems, computed once for each inertia and resistance. So no step is too
# long, and no step can become unstable.

STEP_S: Final = 0.001

Row = tuple[float, float, float, float]  # of current, speed, third input, torque
_Matrix = list[list[float]]


@dataclass(frozen=True, slots=True)
class Discretisation(Immutable):
    """One control step of winding and shaft, as rows of coefficients.

    A step either controls the current to its demand or applies a constant voltage. The rows for a
    controlled current multiply (current before, speed before, current after, torque). The rows for
    a constant voltage multiply (current before, speed before, voltage, torque).

    Attributes:
        speed: row for the speed after the step with a controlled current, in rad/s.
        angle: row for the angle by which the shaft turns in the step with a controlled current, in
            rad.
        voltage: row for the constant voltage that leads to a given current after the step, in V.
        current_u: row for the current after the step with a constant voltage, in A.
        speed_u: row for the speed after the step with a constant voltage, in rad/s.
        angle_u: row for the angle by which the shaft turns in the step with a constant voltage, in
            rad.
        square_u: weights of (di^2, di dw, dw^2) in the integral of the squared current. di and dw
            are distances from the state to which a constant voltage leads.
    """

    speed: Row
    angle: Row
    voltage: Row
    current_u: Row
    speed_u: Row
    angle_u: Row
    square_u: tuple[float, float, float]


@lru_cache(maxsize=256)  # equal drives share it: one is made in a third of the time
def discretise(
    motor: MotorParameters, resistance_ohm: float, inertia_kg_m2: float
) -> Discretisation:
    """Compute the step of a motor with its present resistance and inertia."""
    k, el = motor.torque_constant_nm_a, motor.inductance_h
    dw_di, dw_dw, dw_dm = k / inertia_kg_m2, -motor.viscous_nm_s / inertia_kg_m2, 1 / inertia_kg_m2
    di_di, di_dw = -resistance_ohm / el, -k / el
    led = [  # of speed, angle, current, slope of the current, torque
        [dw_dw, 0.0, dw_di, 0.0, dw_dm],
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0],
    ]
    constant = [  # of current, speed, angle, voltage, torque
        [di_di, di_dw, 0.0, 1 / el, 0.0],
        [dw_di, dw_dw, 0.0, 0.0, dw_dm],
        [0.0, 1.0, 0.0, 0.0, 0.0],
    ]
    speed, angle = ((i - s / STEP_S, w, s / STEP_S, m) for w, _, i, s, m in _step(led)[:2])
    current_u, speed_u, angle_u = ((i, w, u, m) for i, w, _, u, m in _step(constant)[:3])
    i, w, u, m = current_u
    square_u = _square((di_di, di_dw), (dw_di, dw_dw), i, w)
    voltage = (-i / u, -w / u, 1 / u, -m / u)
    return Discretisation(speed, angle, voltage, current_u, speed_u, angle_u, square_u)


def exponential(matrix: _Matrix) -> _Matrix:
    """Return e to the power of a square matrix, by scaling, series and squaring."""
    size = len(matrix)
    largest = max(reduce(float.__add__, map(abs, row)) for row in matrix)
    halvings = 0
    while largest > 0.25:
        largest, halvings = largest / 2, halvings + 1
    scaled = [[x / 2**halvings for x in row] for row in matrix]
    total = [[float(row == column) for column in range(size)] for row in range(size)]
    power = total
    for order in range(1, 12):
        power = [[x / order for x in row] for row in _product(power, scaled)]
        total = [
            [x + y for x, y in zip(a, b, strict=True)] for a, b in zip(total, power, strict=True)
        ]
    for _ in range(halvings):
        total = _product(total, total)
    return total


def _product(a: _Matrix, b: _Matrix) -> _Matrix:
    columns = list(zip(*b, strict=True))
    return [
        [reduce(float.__add__, map(float.__mul__, row, column), 0.0) for column in columns]
        for row in a
    ]


def _step(system: _Matrix) -> _Matrix:
    """Return the step of a system whose last two inputs are constant."""
    return exponential([[x * STEP_S for x in row] for row in [*system, [0.0] * 5, [0.0] * 5]])


def _square(
    current: tuple[float, float], speed: tuple[float, float], i: float, w: float
) -> tuple[float, float, float]:
    """Solve the Lyapunov equation of the squared current over one step.

    Args:
        current: effects of current and speed on the slope of the current.
        speed: effects of current and speed on the slope of the speed.
        i: share of the current that is left after a step.
        w: change of the current by the speed in the step.
    """
    (a, b), (c, d) = current, speed
    s11, s12, s22 = i * i - 1, i * w, w * w
    rest = a + d - b * c / a
    m22 = (s12 - b * s11 / (2 * a) - s22 * rest / (2 * b)) / (c - d * rest / b)
    m12 = (s22 / 2 - d * m22) / b
    m11 = (s11 / 2 - c * m12) / a
    return m11, 2 * m12, m22


@dataclass(slots=True)
class _Losses:
    """Energies since the start.

    Attributes:
        electrical_j: energy from the power stage.
        copper_j: heat of the winding.
        friction_j: heat of friction and gear, and energy of a shaft when it is blocked.
        square_a2s: integral of the squared current, from which the drive computes its heat.
    """

    electrical_j: float = 0.0
    copper_j: float = 0.0
    friction_j: float = 0.0
    square_a2s: float = 0.0


BREAKAWAY: Final = 1.02  # static friction by dry friction; it ends a creep, and makes no jump


class Plant(Part):
    """The electro-mechanical part of a servo, at the motor shaft.

    Dry friction is a torque within bounds. If the bounds allow, it is just large enough to stop the
    shaft in this step (time stepping after Moreau). So the friction does not chatter, and a shaft
    at rest has speed exactly 0.

    Not modelled: the ripple of current regulator and PWM, cogging, play and elasticity, the loss of
    the gear on its inertia.

    Attributes:
        current_a: current in the winding.
        speed_rad_s: speed of the motor.
        position: angle of the motor, in counts.
        blocked: whether the shaft is held.
        load_nm: external torque at the motor shaft, before the loss of the gear.
        friction_nm: bounds of the friction: torque against forward motion, and torque against
            backward motion.
        inertia_kg_m2: present inertia at the motor shaft.
        resistance_ohm: present resistance of the winding.
        losses: energies since the start.
    """

    __slots__ = (
        "_coulomb_nm",
        "_counts_per_rad",
        "_left",
        "_motor",
        "_step",
        "blocked",
        "current_a",
        "friction_nm",
        "inertia_kg_m2",
        "load_nm",
        "losses",
        "position",
        "resistance_ohm",
        "speed_rad_s",
    )

    def __init__(self, parameters: ServoParameters) -> None:
        self._motor, self._coulomb_nm = parameters.motor, parameters.coulomb_nm
        self._counts_per_rad = parameters.encoders.counts_per_turn / (2 * pi)
        self.current_a = self.speed_rad_s = self.position = 0.0
        self.blocked, self.losses = False, _Losses()
        self.bear(0.0, 1.0)
        self.shape(parameters.inertia_kg_m2, parameters.motor.resistance_ohm)

    @property
    def velocity_counts_s(self) -> float:
        """Speed of the motor, counts/s."""
        return self.speed_rad_s * self._counts_per_rad

    @property
    def rows(self) -> tuple[Row, Row]:
        """Coefficients of speed and angle after a step with a controlled current."""
        return self._step.speed, self._step.angle

    @property
    def constants(self) -> tuple[float, float, float, float]:
        """Torque constant, inductance, viscous friction, counts per radian."""
        motor = self._motor
        k, el, b = motor.torque_constant_nm_a, motor.inductance_h, motor.viscous_nm_s
        return k, el, b, self._counts_per_rad

    def shape(self, inertia_kg_m2: float, resistance_ohm: float) -> None:
        """Set another inertia or resistance, without changing the speed."""
        self.inertia_kg_m2, self.resistance_ohm = inertia_kg_m2, resistance_ohm
        self._step = discretise(self._motor, resistance_ohm, inertia_kg_m2)
        self._left = exp(-resistance_ohm * STEP_S / self._motor.inductance_h)

    def bear(self, load_nm: float, efficiency: float) -> None:
        """Set the external torque on the output shaft. The loss in the gear acts as friction.

        If the torque acts against the motion, the motor must supply the torque divided by
        `efficiency`. If the torque acts in the direction of motion, only the share `efficiency` of
        the torque reaches the motor.

        Args:
            load_nm: external torque.
            efficiency: efficiency of the gear.
        """
        # A gear that loses a part of the power acts like friction that depends on the load: the
        # motor supplies 1/efficiency against the load and gets efficiency of it back.
        against, along = abs(load_nm) * (1 / efficiency - 1), abs(load_nm) * (1 - efficiency)
        forward, backward = (along, against) if load_nm > 0 else (against, along)
        self.load_nm = load_nm
        self.friction_nm = (-self._coulomb_nm - forward, self._coulomb_nm + backward)

    def hold(self, blocked: bool) -> None:
        """Hold or release the shaft."""
        if blocked:
            # The energy of the turning shaft goes into the part that holds it. So the sum of the
            # losses stays equal to the work that was put in.
            self.losses.friction_j += self.inertia_kg_m2 * self.speed_rad_s**2 / 2
            self.speed_rad_s = 0.0
        self.blocked = blocked

    def open(self) -> None:
        """Advance motor and load by one control step with the power stage off.

        The winding is open. A remaining current ends at once, and its energy becomes heat.
        """
        # The energy of the inductance, L i^2 / 2, becomes heat at once; no step models its decay.
        self.losses.copper_j += self._motor.inductance_h * self.current_a**2 / 2
        self.current_a = 0.0
        if self.speed_rad_s == 0.0 and self._sticks(0.0):
            return
        (_, s1, _, s3), (_, a1, _, a3) = self._step.speed, self._step.angle
        w, m = self.speed_rad_s, self.load_nm
        friction, speed = self._rub(s1 * w + s3 * m, s3)
        self._turn(speed, a1 * w + a3 * (m + friction), friction)

    def drive(self, current_a: float, limit_v: float) -> int:
        """Advance motor and load by one control step in which the current goes to a demanded value.

        Args:
            current_a: demanded current.
            limit_v: largest voltage of the power stage.

        Returns:
            0 if the voltage is sufficient. Otherwise the sign of the limit that the voltage has
            reached, -1 or 1.
        """
        # Standstill is handled separately: winding alone, without back-EMF. The general step uses
        # one friction for the whole step; with it the shaft would end at speed 0, but its angle
        # would creep during the step.
        if self.speed_rad_s == 0.0 and (cut := self._stay(current_a, limit_v)) is not None:
            return cut
        step, motor, i, w = self._step, self._motor, self.current_a, self.speed_rad_s
        s0, s1, s2, s3 = step.speed
        free = s0 * i + s1 * w + s2 * current_a + s3 * self.load_nm
        friction, speed = self._rub(free, s3)
        k, r, rise = motor.torque_constant_nm_a, self.resistance_ohm, current_a - i
        slope_v = motor.inductance_h * rise / STEP_S
        if (
            not -limit_v <= r * i + k * w + slope_v <= limit_v
            # The voltage that leads the current to its demand is checked at both ends of the step.
            # Between the ends the current changes linearly.
            or not -limit_v <= r * current_a + k * speed + slope_v <= limit_v
        ):
            return self._drive_constant(current_a, limit_v, friction)
        a0, a1, a2, a3 = step.angle
        way = a0 * i + a1 * w + a2 * current_a + a3 * (self.load_nm + friction)
        self._lead(current_a, k * self._mean(current_a, speed, way))
        self._turn(speed, way, friction)
        return 0

    def _drive_constant(self, current_a: float, limit_v: float, friction: float) -> int:
        """Run a step at the constant voltage that leads to a current, or at the nearest voltage."""
        step, i, w, m = self._step, self.current_a, self.speed_rad_s, self.load_nm
        v0, v1, v2, v3 = step.voltage
        u, cut = _within(v0 * i + v1 * w + v2 * current_a + v3 * (m + friction), limit_v)
        s0, s1, s2, s3 = step.speed_u
        # The friction was computed for a led current. The voltage is not enough for that current,
        # so the shaft ends at another speed.
        friction, speed = self._rub(s0 * i + s1 * w + s2 * u + s3 * m, s3)
        m += friction
        a0, a1, a2, a3 = step.angle_u
        way = a0 * i + a1 * w + a2 * u + a3 * m
        c0, c1, c2, c3 = step.current_u
        self._carry(c0 * i + c1 * w + c2 * u + c3 * m, u, way, m)
        self._turn(speed, way, friction)
        return cut

    def _stay(self, current_a: float, limit_v: float) -> int | None:
        """Run a step at standstill; return None if the shaft would not stay at rest."""
        i, r, left = self.current_a, self.resistance_ohm, self._left
        slope_v = self._motor.inductance_h * abs(current_a - i) / STEP_S
        straight, cut, u = r * max(abs(i), abs(current_a)) + slope_v <= limit_v, 0, 0.0
        if not straight:
            u, cut = _within(r * (current_a - left * i) / (1 - left), limit_v)
            current_a = left * i + (1 - left) * u / r
        if not (self._sticks(i) and self._sticks(current_a)):
            return None
        if straight:
            self._lead(current_a, 0.0)
        else:
            self._approach(current_a, u)
        return cut

    def _approach(self, current_a: float, u: float) -> None:
        """Store the current after a step of constant voltage at standstill."""
        i, r, el, left = self.current_a, self.resistance_ohm, self._motor.inductance_h, self._left
        charge, end = (u * STEP_S - el * (current_a - i)) / r, u / r
        square = (1 - left * left) * el / (2 * r) * (i - end) ** 2
        self._pay(current_a, u * charge, square + (2 * charge - end * STEP_S) * end)

    def _sticks(self, current_a: float) -> bool:
        """Return whether friction holds the shaft against this current and the load."""
        low, high = self.friction_nm
        friction = -self._motor.torque_constant_nm_a * current_a - self.load_nm
        return low * BREAKAWAY <= friction <= high * BREAKAWAY or self.blocked

    def _rub(self, free: float, per_nm: float) -> tuple[float, float]:
        """Return the friction, and the speed after a step that ends at `free` without friction."""
        low, high = self.friction_nm
        friction = -free / per_nm
        if low * BREAKAWAY <= friction <= high * BREAKAWAY:
            return friction, 0.0
        friction = low if friction < low else high
        return friction, free + per_nm * friction

    def _lead(self, current_a: float, back_emf_j: float) -> None:
        """Store a current that followed a straight line to its demand."""
        i = self.current_a
        square = (i * i + i * current_a + current_a * current_a) / 3 * STEP_S
        magnetic = self._motor.inductance_h * (current_a * current_a - i * i) / 2
        self._pay(current_a, self.resistance_ohm * square + magnetic + back_emf_j, square)

    def _mean(self, current_a: float, speed: float, way: float) -> float:
        """Return the integral of current times speed, by Simpson's rule."""
        i, w = self.current_a, self.speed_rad_s
        # Simpson's rule in reverse: the angle that the shaft turns is known exactly. It gives the
        # speed in the middle of the step, and this speed gives the integral of i * w.
        middle = (6 * way / STEP_S - w - speed) / 4
        return (i * w + 2 * (i + current_a) * middle + current_a * speed) * STEP_S / 6

    def _carry(self, current_a: float, u: float, way: float, m: float) -> None:
        """Store the current after a step of constant voltage."""
        motor, i, r = self._motor, self.current_a, self.resistance_ohm
        k, b = motor.torque_constant_nm_a, motor.viscous_nm_s
        charge = (u * STEP_S - motor.inductance_h * (current_a - i) - k * way) / r
        scale = 1 / (r * b + k * k)
        end = (u * b - k * m) * scale
        di, dw = i - end, self.speed_rad_s - (u * k + r * m) * scale
        q0, q1, q2 = self._step.square_u
        square = q0 * di * di + q1 * di * dw + q2 * dw * dw + (2 * charge - end * STEP_S) * end
        self._pay(current_a, u * charge, square)

    def _pay(self, current_a: float, electrical_j: float, square_a2s: float) -> None:
        """Store a current and its losses."""
        losses = self.losses
        losses.electrical_j += electrical_j
        losses.square_a2s += square_a2s
        losses.copper_j += self.resistance_ohm * square_a2s
        self.current_a = current_a

    def _turn(self, speed: float, way: float, friction: float) -> None:
        """Store speed and angle after a step, and the friction losses."""
        w = self.speed_rad_s
        viscous = self._motor.viscous_nm_s * (w * w + w * speed + speed * speed) / 3 * STEP_S
        self.losses.friction_j += viscous - friction * way
        self.speed_rad_s = speed
        self.position += way * self._counts_per_rad


def _within(voltage: float, limit_v: float) -> tuple[float, int]:
    """Return the voltage clamped to a limit, and the direction of the cut."""
    if -limit_v <= voltage <= limit_v:
        return voltage, 0
    return (limit_v, 1) if voltage > 0 else (-limit_v, -1)
