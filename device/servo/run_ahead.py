"""Several control steps of a servo in one go: the plain ones, in which nothing happens."""

from __future__ import annotations

from math import floor

from tickrig.device.servo.discretisation import STEP_S
from tickrig.device.servo.loops import Loops
from tickrig.device.servo.plant import BREAKAWAY, Plant
from tickrig.device.twin import Part

Demands = list[tuple[float, float]]
"""Position in counts and velocity in counts/s, for each step."""

Bounds = tuple[float, float, float, float, float, float]
"""Where a run ends: before a step that would lead out of these bounds.

Largest current that is demanded, A; largest voltage at the winding, V; lowest and highest
position, counts; largest distance from the demanded position, counts; velocity, counts/s, up to
which the motor stands: it may not stand while it is demanded to turn faster.
"""

Four = tuple[float, float, float, float]


class RunAhead(Part):
    """Where a servo is after some steps.

    Attributes:
        steps: how many there are.
        counts: what the encoder says.
        motion: position of the motor, counts; its speed, rad/s; current in the winding, A;
            integral of the velocity loop, A.
        losses: what came out of the power stage, since the start, J; heat of the winding, J;
            heat of friction, J; integral of the squared current, A^2 s.
    """

    __slots__ = ("counts", "losses", "motion", "steps")

    def __init__(self, steps: int, counts: int, motion: Four, losses: Four) -> None:
        self.steps, self.counts, self.motion, self.losses = steps, counts, motion, losses


def work_out(  # noqa: PLR0915 - one loop over locals
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
    (counts, lost_counts), (most_a, most_v, first, last, window, slow) = encoder, bounds
    losses = plant.losses
    electrical, copper = losses.electrical_j, losses.copper_j
    rubbed, squares = losses.friction_j, losses.square_a2s
    angle, w, i, integral = plant.position, plant.speed_rad_s, plant.current_a, loops.integral_a
    fast, steps = slow + 1.0, 0
    for position, velocity in demands:
        error = position - counts
        if velocity == 0.0 and -1.0 < error < 1.0:
            error = 0.0
        wanted = (velocity + stiffness * error) * rad
        error = wanted - w
        led = integral + integral_gain * error
        current = led + proportional * error + viscous * wanted
        if wanted != 0.0:
            current += dry if wanted > 0.0 else -dry  # `copysign` is a call of Python
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
        rate = speed * per_rad
        rolls = not -fast <= rate <= fast or abs(round(rate)) > slow  # `round` is one, too
        turns = rolls or -slow <= velocity <= slow
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
    return RunAhead(steps, counts, (angle, w, i, integral), (electrical, copper, rubbed, squares))
