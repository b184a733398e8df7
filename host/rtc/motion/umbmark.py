"""UMBmark: errors of an odometry, measured by squares in both directions, and corrected.

Source: Borenstein and Feng, Measurement and Correction of Systematic Odometry Errors in
Mobile Robots, IEEE Transactions on Robotics and Automation 12 (6), 1996.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import fsum, hypot, pi, sin
from typing import Final

from tickrig.host.rtc.motion.drive import BaseConnection, OnSample, drive
from tickrig.host.rtc.motion.geometry import Pose, Wheels

SIDE_M: Final = 4.0

Error = tuple[float, float]
"""Difference between the true position of a cart and its estimate: x, y in m."""


@dataclass(frozen=True, slots=True)
class Umbmark:
    """Result of a UMBmark test, which measures the errors of a cart's odometry by driving squares.

    Attributes:
        clockwise: error in m (x, y) of each run in clockwise direction.
        counter_clockwise: error in m (x, y) of each run in counter-clockwise direction.
        returns_m: distance of the cart from its start at the end of each run.
    """

    clockwise: tuple[Error, ...]
    counter_clockwise: tuple[Error, ...]
    returns_m: tuple[float, ...] = ()

    @property
    def most_m(self) -> float:
        """The systematic error of the odometry in m (E_max,syst).

        For each of the two directions, the errors of all runs are averaged. The two mean errors are
        vectors (x, y). The result is the length of the longer vector.
        """
        return max(hypot(*_centre(self.clockwise)), hypot(*_centre(self.counter_clockwise)))

    def corrected(self, wheels: Wheels, side_m: float = SIDE_M) -> Wheels:
        """Return the geometry that compensates the errors. The mean radius is unchanged."""
        (x_cw, _), (x_ccw, _) = _centre(self.clockwise), _centre(self.counter_clockwise)
        alpha = (x_cw + x_ccw) / (-4 * side_m)
        beta = (x_cw - x_ccw) / (-4 * side_m)
        axle = wheels.axle * (pi / 2) / (pi / 2 - alpha)
        share = 1.0
        if beta:
            radius = side_m / 2 / sin(beta / 2)
            share = (radius + axle / 2) / (radius - axle / 2)
        mean = (wheels.left + wheels.right) / 2
        ratio = wheels.right / wheels.left * share
        return Wheels(2 * mean / (ratio + 1), 2 * mean * ratio / (ratio + 1), axle)


def _centre(errors: Sequence[Error]) -> Error:
    """Return the centre of gravity of errors.

    >>> _centre([(0.0, 1.0), (2.0, 3.0)])
    (1.0, 2.0)
    """
    return fsum(x for x, _ in errors) / len(errors), fsum(y for _, y in errors) / len(errors)


def square(*, clockwise: bool, side_m: float = SIDE_M) -> list[Pose]:
    """Return the corners of a square that starts and ends at the origin."""
    y = -side_m if clockwise else side_m
    return [Pose(side_m), Pose(side_m, y), Pose(0.0, y), Pose()]


def run_umbmark(
    begin: Callable[[int], BaseConnection],
    true_pose: Callable[[BaseConnection], Pose] = lambda connection: connection.pose,
    runs: int = 5,
    side_m: float = SIDE_M,
    watch: OnSample = lambda sample: None,
) -> Umbmark:
    """Run a UMBmark test: drive squares in both directions, and return the errors of the odometry.

    Args:
        begin: function that prepares a run and returns the connection to the cart. Its argument is
            the number of the run, from 0 on. The function must place the cart at the origin and
            activate the components.
        true_pose: function that measures the position of the cart at the end of a run.
        runs: number of runs in each direction.
        side_m: side length of the squares in m. The original UMBmark test has squares of 4 m.
        watch: function that is called with each sample.

    Raises:
        TimeoutError: a square did not end in time.
    """
    errors: dict[bool, list[Error]] = {True: [], False: []}
    returns = []
    for number in range(2 * runs):
        clockwise = number % 2 == 0
        connection = begin(number)
        if drive(connection, square(clockwise=clockwise, side_m=side_m), watch).reached_s is None:
            raise TimeoutError(f"square {number + 1} did not end")
        truth, thought = true_pose(connection), connection.chain.odometry.pose
        errors[clockwise].append((truth.x - thought.x, truth.y - thought.y))
        returns.append(truth.distance(Pose()))
    return Umbmark(tuple(errors[True]), tuple(errors[False]), tuple(returns))
