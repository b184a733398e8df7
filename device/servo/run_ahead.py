"""Several control steps of a servo in one go: the plain ones, in which nothing happens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, floor

from tickrig.device.servo.discretisation import STEP_S
from tickrig.device.servo.loops import Loops
from tickrig.device.servo.plant import BREAKAWAY, Plant
from tickrig.device.twin import Immutable

Demands = Sequence[tuple[float, float]]
"""Position in counts and velocity in counts/s, for each step."""


@dataclass(frozen=True, slots=True)
class Bounds(Immutable):
    """Where a run ends: before a step that would lead out of these bounds.

    Attributes:
        current_a: largest current that is demanded.
        voltage_v: largest voltage at the winding.
        counts: lowest and highest position.
        error: largest distance from the demanded position, counts.
        standstill: velocity, counts/s, up to which the motor stands; it may not stand while
            it is demanded to turn faster.
    """

    current_a: float
    voltage_v: float
    counts: tuple[float, float]
    error: float
    standstill: float


@dataclass(slots=True)
class RunAhead:
    """Where a servo is after some steps.

    Attributes:
        steps: how many there are.
        counts: what the encoder says.
        position: of the motor, counts.
        speed_rad_s: of the motor.
        current_a: in the winding.
        integral_a: of the velocity loop.
        electrical_j: what came out of the power stage, since the start.
        copper_j: heat of the winding.
        friction_j: heat of friction.
        square_a2s: integral of the squared current.
    """

    steps: int
    counts: int
    position: float
    speed_rad_s: float
    current_a: float
    integral_a: float
    electrical_j: float
    copper_j: float
    friction_j: float
    square_a2s: float


def work_out(
    plant: Plant, loops: Loops, encoder: tuple[int, float], demands: Demands, bounds: Bounds
) -> RunAhead:
    """Work out what the loops and the plant do in steps with a position demand, to the bit.

    Nothing is changed. The run ends before the first step in which friction stops the shaft
    or holds it, the demand is cut, or the bounds are left: then `Servo` goes on by single steps.

    Args:
        plant: as it is now.
        loops: as they are now; no demand is cut.
        encoder: the counts that it says now, and by how many it is off.
        demands: for each step, without acceleration.
        bounds: where the run ends.
    """
    # one loop over locals takes half the time of calls
    (s0, s1, s2, s3), (a0, a1, a2, a3) = plant.rows
    k, el, b, per_rad = plant.constants
    rad, stiffness, integral_gain, proportional, viscous, dry = loops.gains
    r, load, blocked = plant.resistance_ohm, plant.load_nm, plant.blocked
    low, high = plant.friction_nm
    low_breakaway, high_breakaway = low * BREAKAWAY, high * BREAKAWAY
    most_a, most_v, window, slow = (
        *(bounds.current_a, bounds.voltage_v, bounds.error, bounds.standstill),
    )
    (counts, lost_counts), (first, last) = encoder, bounds.counts
    losses = plant.losses
    electrical, copper, rubbed, squares = (
        *(losses.electrical_j, losses.copper_j, losses.friction_j, losses.square_a2s),
    )
    angle, w, i, integral = plant.position, plant.speed_rad_s, plant.current_a, loops.integral_a
    steps = 0
    for position, velocity in demands:
        error = position - counts
        if velocity == 0.0 and -1.0 < error < 1.0:
            error = 0.0
        wanted = (velocity + stiffness * error) * rad
        error = wanted - w
        led = integral + integral_gain * error
        current = led + proportional * error + viscous * wanted
        if wanted != 0.0:
            current += copysign(dry, wanted)
        current += 0.0  # no acceleration is fed forward
        if w == 0.0 or blocked or not -most_a <= current <= most_a:
            break
        free = s0 * i + s1 * w + s2 * current + s3 * load
        friction = -free / s3
        if low_breakaway <= friction <= high_breakaway:
            break
        friction = low if friction < low else high
        speed = free + s3 * friction
        slope_v = el * (current - i) / STEP_S
        if (
            not -most_v <= r * i + k * w + slope_v <= most_v
            or not -most_v <= r * current + k * speed + slope_v <= most_v
        ):
            break
        way = a0 * i + a1 * w + a2 * current + a3 * (load + friction)
        ahead = angle + way * per_rad
        seen = floor(ahead - lost_counts + 0.5)
        turns = abs(velocity) <= slow or abs(round(speed * per_rad)) > slow
        follows = turns and -window <= position - seen <= window
        if not (follows and first <= seen <= last and speed):
            break
        square = (i * i + i * current + current * current) / 3 * STEP_S
        middle = (6 * way / STEP_S - w - speed) / 4
        mean = (i * w + 2 * (i + current) * middle + current * speed) * STEP_S / 6
        electrical += r * square + el * (current * current - i * i) / 2 + k * mean
        squares += square
        copper += r * square
        rubbed += b * (w * w + w * speed + speed * speed) / 3 * STEP_S - friction * way
        angle, w, i, integral, counts = ahead, speed, current, led, seen
        steps += 1
    return RunAhead(
        *(steps, counts, angle, w, i, integral),
        *(electrical, copper, rubbed, squares),
    )
