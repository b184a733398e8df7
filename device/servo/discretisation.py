"""The exact answer of winding and shaft to one control step.

    L di/dt = u - R i - k w
    J dw/dt = k i - b w + m        m: torque of load and friction

is linear, so the state after a step is a matrix times the state before it. As
long as the voltage allows, the current regulator, which is much faster than a
step, leads the current on a straight line to its demand; else the voltage is
constant. The matrices come from exponentials of the two systems, once for each
inertia and resistance, so no step is too long and none can become unstable.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Final

from tickrig.device.servo.parameters import MotorParameters
from tickrig.device.twin import Immutable

STEP_S: Final = 0.001

Row = tuple[float, float, float, float]  # of current, speed, third input, torque
Matrix = list[list[float]]


@dataclass(frozen=True, slots=True)
class Discretisation(Immutable):
    """One control step of winding and shaft as rows of numbers.

    The rows of a led current multiply (current before, speed before, current
    after, torque); those of a constant voltage (current before, speed before,
    voltage, torque).

    Attributes:
        speed: speed after the step, current led, rad/s.
        angle: way of the shaft, current led, rad.
        voltage: constant voltage that ends at a current after the step, V.
        current_u: current after the step, voltage constant, A.
        speed_u: speed after the step, voltage constant, rad/s.
        angle_u: way of the shaft, voltage constant, rad.
        square_u: weights of (di^2, di dw, dw^2) in the integral of the squared current;
            di and dw are distances from the state to which a constant voltage leads.
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
    """Work out the step of a motor with its present resistance and inertia."""
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


def exponential(matrix: Matrix) -> Matrix:
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


def _product(a: Matrix, b: Matrix) -> Matrix:
    columns = list(zip(*b, strict=True))
    return [
        [reduce(float.__add__, map(float.__mul__, row, column), 0.0) for column in columns]
        for row in a
    ]


def _step(system: Matrix) -> Matrix:
    """Return the step of a system whose last two inputs are constant."""
    return exponential([[x * STEP_S for x in row] for row in [*system, [0.0] * 5, [0.0] * 5]])


def _square(
    current: tuple[float, float], speed: tuple[float, float], i: float, w: float
) -> tuple[float, float, float]:
    """Solve the Lyapunov equation of the squared current over one step.

    Args:
        current: what current and speed do to the slope of the current.
        speed: what they do to that of the speed.
        i: part of the current that is left after a step.
        w: what the speed has done to the current by then.
    """
    (a, b), (c, d) = current, speed
    s11, s12, s22 = i * i - 1, i * w, w * w
    rest = a + d - b * c / a
    m22 = (s12 - b * s11 / (2 * a) - s22 * rest / (2 * b)) / (c - d * rest / b)
    m12 = (s22 / 2 - d * m22) / b
    m11 = (s11 / 2 - c * m12) / a
    return m11, 2 * m12, m22
