"""The exact answer of winding and shaft to one control step.

Between two control steps voltage, friction and load are constant, and

    L di/dt = u - R i - k w
    J dw/dt = k i - b w + m        m: torque of load and friction

is linear: the state at the end of the step is a matrix times the state at its
start. The matrix comes from the exponential of the system once for each
inertia and resistance, so no step is too long and none can become unstable.
"""

from __future__ import annotations

from dataclasses import dataclass

STEP_S = 0.001

Row = tuple[float, float, float, float]  # of current, speed, third input, torque
Matrix = list[list[float]]


@dataclass(frozen=True, slots=True)
class Discretisation:
    """One control step of winding and shaft as rows of numbers.

    The rows of an imposed current multiply (current before, speed before,
    current after, torque); those of an imposed voltage (current before, speed
    before, voltage, torque).

    Attributes:
        speed: speed after the step, current imposed, rad/s.
        angle: way of the shaft, current imposed, rad.
        voltage: voltage that imposes the current, V.
        current_u: current after the step, voltage imposed, A.
        speed_u: speed after the step, voltage imposed, rad/s.
        angle_u: way of the shaft, voltage imposed, rad.
        square: weights of (di^2, di dw, dw^2) in the integral of the squared current;
            di and dw are distances from the state to which a constant voltage leads.
    """

    speed: Row
    angle: Row
    voltage: Row
    current_u: Row
    speed_u: Row
    angle_u: Row
    square: tuple[float, float, float]


def discretise(r: float, el: float, k: float, j: float, b: float) -> Discretisation:
    """Work out the step of a motor.

    Args:
        r: resistance, ohm.
        el: inductance, H.
        k: torque constant, Nm/A.
        j: inertia, kg m2.
        b: viscous friction, Nm s.
    """
    system = [  # of current, speed, angle, voltage, torque
        [-r / el, -k / el, 0.0, 1 / el, 0.0],
        [k / j, -b / j, 0.0, 0.0, 1 / j],
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0] * 5,
        [0.0] * 5,
    ]
    current, speed, angle = (
        (row[0], row[1], row[3], row[4])
        for row in exponential([[x * STEP_S for x in row] for row in system])[:3]
    )
    i, w, u, m = current
    voltage = (-i / u, -w / u, 1 / u, -m / u)
    return Discretisation(
        speed=_impose(speed, voltage),
        angle=_impose(angle, voltage),
        voltage=voltage,
        current_u=current,
        speed_u=speed,
        angle_u=angle,
        square=_square(system, i, w),
    )


def coast(j: float, b: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Work out the step of a shaft without current: weights of (speed, torque).

    Args:
        j: inertia, kg m2.
        b: viscous friction, Nm s.

    Returns:
        Those of the speed after the step, and those of the way of the shaft.
    """
    system = [[-b / j, 0.0, 1 / j], [1.0, 0.0, 0.0], [0.0] * 3]
    speed, angle, _ = exponential([[x * STEP_S for x in row] for row in system])
    return (speed[0], speed[2]), (angle[0], angle[2])


def exponential(matrix: Matrix) -> Matrix:
    """Return e to the power of a square matrix, by scaling, series and squaring."""
    size = len(matrix)
    largest = max(sum(abs(x) for x in row) for row in matrix)
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
    return [[sum(map(float.__mul__, row, column)) for column in columns] for row in a]


def _impose(row: Row, voltage: Row) -> Row:
    """Put the voltage that imposes a current into a row of an imposed voltage."""
    i, w, u, m = row
    return i + u * voltage[0], w + u * voltage[1], u * voltage[2], m + u * voltage[3]


def _square(system: Matrix, i: float, w: float) -> tuple[float, float, float]:
    """Solve the Lyapunov equation of the squared current over one step."""
    (a, b), (c, d) = system[0][:2], system[1][:2]
    s11, s12, s22 = i * i - 1, i * w, w * w
    rest = a + d - b * c / a
    m22 = (s12 - b * s11 / (2 * a) - s22 * rest / (2 * b)) / (c - d * rest / b)
    m12 = (s22 / 2 - d * m22) / b
    m11 = (s11 / 2 - c * m12) / a
    return m11, 2 * m12, m22
