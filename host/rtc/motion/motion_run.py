"""The record of a cart's motion, and its quality (rh3-control, customary measures)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from math import fsum, sqrt
from typing import Final, NamedTuple

from tickrig.host.canmon.model.graph.plot import DOTS_X, DOTS_Y, Canvas
from tickrig.host.rtc.motion.control_laws import VelocityLimits
from tickrig.host.rtc.motion.geometry import Pose, Twist

_LONG_M: Final = 1.0
"""Length in m from which a leg is judged by its cross-track error."""

_ROUNDING: Final = 1e-9


class TrackSample(NamedTuple):
    """State of a cart in one period of a recorded motion.

    Attributes:
        time_s: time since the start of the record in s.
        pose: pose of the cart.
        twist: commanded velocity.
        line: pose at the end of the straight line that the cart follows, or None while the cart
            turns or stands.
    """

    time_s: float
    pose: Pose
    twist: Twist
    line: Pose | None


class _CrossTrack(NamedTuple):
    """Distance from the line in m, as root mean square and as maximum."""

    rms: float
    most: float


@dataclass(slots=True)
class MotionRun:
    """Record of a cart's motion to a goal, with measures of its quality.

    Attributes:
        goal: pose at which the motion should end.
        samples: states of the cart, one for each period.
        reached_s: time in s at which the components reported that the goal was reached, or None if
            they did not report it.
    """

    goal: Pose
    samples: list[TrackSample] = field(default_factory=list)
    reached_s: float | None = None

    @property
    def duration_s(self) -> float:
        """Duration of the record."""
        return self.samples[-1].time_s

    @property
    def end(self) -> Pose:
        """Last pose of the cart."""
        return self.samples[-1].pose

    @property
    def error_m(self) -> float:
        """Distance of the last pose from the goal."""
        return self.end.distance(self.goal)

    @property
    def heading_error_rad(self) -> float:
        """Deviation of the last heading from the heading of the goal, without sign."""
        return self.end.turn_to(self.goal)

    @property
    def turning_rad_s(self) -> float:
        """The sum of all changes of the commanded angular velocity."""
        return fsum(abs(b.twist.w - a.twist.w) for a, b in pairwise(self.samples))

    @property
    def cross_track(self) -> _CrossTrack:
        """Distance of the cart from the long lines of its path."""
        legs = self._long_legs()
        errors = [line.left(sample.pose) for line, leg in legs for sample in leg] or [0.0]
        square = fsum(error * error for error in errors) / len(errors)
        return _CrossTrack(sqrt(square), max(map(abs, errors)))

    def violations(self, limits: VelocityLimits) -> int:
        """Return the number of commands that exceeded a limit."""
        return sum(_violates(a.twist, b.twist, limits) for a, b in pairwise(self.samples))

    def _long_legs(self) -> Sequence[tuple[Pose, list[TrackSample]]]:
        legs = [(line, list(leg)) for line, leg in groupby(self.samples, lambda s: s.line)]
        return [
            (line, leg)
            for line, leg in legs
            if line is not None and leg[0].pose.distance(line) >= _LONG_M
        ]


def _violates(before: Twist, now: Twist, limits: VelocityLimits) -> bool:
    return (
        abs(now.v) > limits.v + _ROUNDING
        or abs(now.w) > limits.w + _ROUNDING
        or abs(now.v - before.v) > limits.dv + _ROUNDING
        or abs(now.w - before.w) > limits.dw + _ROUNDING
    )


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Largest velocities and accelerations of a cart, as in the default configuration set.

    Attributes:
        v: maximum forward velocity in m/s.
        w: maximum angular velocity in rad/s.
        acceleration: maximum acceleration in m/s2.
        angular_acceleration: maximum angular acceleration in rad/s2.
    """

    v: float = 0.3
    w: float = 0.3
    acceleration: float = 0.3
    angular_acceleration: float = 5.0


def way_time_s(way: float, speed: float, acceleration: float) -> float:
    """Return the time of a straight motion that starts and ends at rest.

    >>> way_time_s(3.0, 0.3, 0.3), way_time_s(0.3, 1.0, 0.3)
    (11.0, 2.0)
    """
    if way < speed * speed / acceleration:
        return 2 * sqrt(way / acceleration)
    return way / speed + speed / acceleration


def least_time_s(relays: Sequence[Pose], limits: MotionLimits | None = None) -> float:
    """Return the shortest time for a list of poses made by `omni_to_2wd.plan`.

    >>> round(least_time_s([Pose(), Pose(), Pose(3.0), Pose(3.0, 0.0, 0.3)]), 2)
    12.06
    """
    limits = limits or MotionLimits()
    return fsum(
        way_time_s(here.distance(there), limits.v, limits.acceleration)
        + way_time_s(here.turn_to(there), limits.w, limits.angular_acceleration)
        for here, there in pairwise(relays)
    )


# A map of a cart's track in braille letters, once or again and again in one place.

WIDTH: Final = 60
_HEIGHT: Final = 16
"""Width and height of a map in cells."""
_MARGIN: Final = 0.08
"""Share of the larger side that is left free around the map."""
_SMALLEST_M: Final = 0.5
_DRAW_EVERY: Final = 10
"""Number of samples from one drawing to the next."""
_MARK: Final = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))


class TrackMap:
    """Map drawn with text characters that shows the goals and the track of a cart.

    The scale is the largest one at which all points fit. The x axis points to the right, and the y
    axis points up.

    Args:
        points: points that the map must contain.
        width: width of the map in characters.
        height: height of the map in lines.

    >>> track = TrackMap([Pose(), Pose(2.0, 1.0)], width=6, height=2)
    >>> for n in range(21):
    ...     track.add(Pose(n / 10, n / 20))
    >>> track.rows()
    ['   ⣀⠴⠗', '⢴⠖⠉⠁  ']
    """

    def __init__(self, points: Sequence[Pose], width: int = WIDTH, height: int = _HEIGHT) -> None:
        xs, ys = [p.x for p in points], [p.y for p in points]
        columns, rows = width * DOTS_X - 1, height * DOTS_Y - 1
        spans = max(xs) - min(xs), max(ys) - min(ys)
        room = 1 - 2 * _MARGIN
        self._scale = max(
            spans[0] / (columns * room), spans[1] / (rows * room), _SMALLEST_M / columns
        )
        self._left = (max(xs) + min(xs)) / 2 - columns / 2 * self._scale
        self._top = (max(ys) + min(ys)) / 2 + rows / 2 * self._scale
        self._canvas = Canvas(width, height)
        for point in points:
            x, y = self._dot(point)
            for right, down in _MARK:
                self._set(x + right, y + down)

    def add(self, pose: Pose) -> None:
        """Mark the position of the cart. Positions outside of the map are not marked."""
        self._set(*self._dot(pose))

    def rows(self) -> list[str]:
        """Return the map, with a text for each row of cells."""
        canvas = self._canvas
        return ["".join(text for text, _ in canvas.row(row)) for row in range(canvas.height)]

    def _dot(self, pose: Pose) -> tuple[int, int]:
        return round((pose.x - self._left) / self._scale), round((self._top - pose.y) / self._scale)

    def _set(self, x: int, y: int) -> None:
        if 0 <= x < self._canvas.width * DOTS_X:
            self._canvas.fill(x, y, y)


class LiveMap:
    """Map of a moving cart on a terminal, which is drawn again after a fixed number of samples.

    A line below the map shows time, pose and velocity.

    Args:
        track: map that is drawn.
        paint: function that writes text to the terminal. The text may contain cursor movements.
    """

    def __init__(self, track: TrackMap, paint: Callable[[str], None]) -> None:
        self._track, self._paint = track, paint
        self._count = self._height = 0

    def watch(self, sample: TrackSample) -> None:
        """Add a sample. Draw the map if that is due."""
        self._track.add(sample.pose)
        if self._count % _DRAW_EVERY == 0:
            self._draw(sample)
        self._count += 1

    def _draw(self, sample: TrackSample) -> None:
        (x, y, heading), (v, w) = sample.pose, sample.twist
        numbers = f"{sample.time_s:7.2f} s  {x:+.3f} {y:+.3f} m  {heading:+.3f} rad"
        lines = [*self._track.rows(), f"{numbers}  {v:+.2f} m/s  {w:+.2f} rad/s"]
        up = f"\x1b[{self._height}A" if self._height else ""
        self._paint(up + "".join(f"{line}\x1b[K\n" for line in lines))
        self._height = len(lines)
