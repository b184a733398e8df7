"""Trapezoidal profiles, and a reference that follows them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from math import copysign, cos, pi, sin, sqrt
from typing import Final, NamedTuple

from tickrig.device.canopen.ds402.axis import Reference
from tickrig.device.canopen.slave import TICK_US
from tickrig.device.twin import Immutable, Part

# Motion profiles: the path to a position or a velocity within limits, in closed form.
#
# A path is planned when the target or a limit changes, from the motion at that moment. It is
# evaluated at any later time. Therefore it is exact: it ends on its target without drift,
# whatever the times of the control steps are. Each ramp of a path has the shape of 6086h. In
# every shape, the distance of a ramp is the mean of its two velocities times its duration, so one
# plan serves all shapes.

_US_PER_S: Final = 1_000_000


class RampShape(IntEnum):
    """Motion profile type (6086h); jerk-free 2 and jerk-limited 3 are not supported."""

    LINEAR = 0
    SIN2 = 1


class Motion(NamedTuple):
    """Position, velocity and acceleration, in any unit of length, unit/s and unit/s^2."""

    position: float
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class PathLimits(Immutable):
    """Limits of velocity and acceleration within which a path is planned, all greater than 0.

    Attributes:
        velocity: the highest velocity.
        acceleration: acceleration while the speed increases. For a sin^2 ramp it is the peak value.
        deceleration: acceleration while the speed decreases. For a sin^2 ramp it is the peak value.
        shape: shape of the ramps.
    """

    velocity: float
    acceleration: float
    deceleration: float
    shape: RampShape = RampShape.LINEAR


class _Leg(NamedTuple):
    """A part of a path: a change to a velocity in a time."""

    velocity: float
    duration_s: float


@dataclass(frozen=True, slots=True)
class _RampLeg(Immutable):
    """A leg with its start time and position."""

    end_s: float
    duration_s: float
    start: float
    velocity: float
    change: float
    shape: RampShape

    def at(self, now_s: float) -> Motion:
        """Return the motion at a time of this leg."""
        since_s = now_s - self.end_s + self.duration_s
        straight = self.start + self.velocity * since_s
        if self.shape is RampShape.LINEAR or self.change == 0.0:
            acceleration = self.change / self.duration_s
            gained = acceleration * since_s
            return Motion(straight + gained * since_s / 2, self.velocity + gained, acceleration)
        half, rate = self.change / 2, pi / self.duration_s
        angle = rate * since_s
        return Motion(
            straight + half * (since_s - sin(angle) / rate),
            self.velocity + half * (1.0 - cos(angle)),
            half * rate * sin(angle),
        )


class Path(Part):
    """A planned motion of the reference: ramps, and times of constant velocity between them.

    After its end the motion continues at the last velocity.

    Attributes:
        began_us: time at which the path begins.
        end_s: duration of the path, in seconds.
        end: position and velocity at the end of the path.
    """

    __slots__ = ("_ramps", "began_us", "end", "end_s")

    def __init__(
        self,
        now_us: int,
        start: Motion,
        legs: Iterable[_Leg],
        shape: RampShape = RampShape.LINEAR,
        target: float | None = None,
    ) -> None:
        """Join legs into a path.

        Args:
            now_us: time at which the path begins.
            start: position and velocity at the beginning.
            legs: parts of the path.
            shape: shape of the ramps.
            target: exact end position, if known.
        """
        position, velocity, end_s = start.position, start.velocity, 0.0
        ramps = []
        for leg in legs:
            change, end_s = leg.velocity - velocity, end_s + leg.duration_s
            ramps.append(_RampLeg(end_s, leg.duration_s, position, velocity, change, shape))
            position += (velocity + leg.velocity) / 2 * leg.duration_s
            velocity = leg.velocity
        self._ramps = [ramp for ramp in ramps if ramp.duration_s > 0.0]
        self.began_us, self.end_s = now_us, end_s
        self.end = Motion(position if target is None else target, velocity)

    def at(self, now_us: int) -> Motion:
        """Return the motion at a time, which must not be before the beginning."""
        now_s = (now_us - self.began_us) / _US_PER_S
        for ramp in self._ramps:
            if now_s < ramp.end_s:
                return ramp.at(now_s)
        since_s = now_s - self.end_s
        return Motion(self.end.position + self.end.velocity * since_s, self.end.velocity)

    def ended(self, now_us: int) -> bool:
        """Return whether the target is reached."""
        return (now_us - self.began_us) / _US_PER_S >= self.end_s


def to_velocity(now_us: int, start: Motion, velocity: float, limits: PathLimits) -> Path:
    """Plan the path from the present motion to another velocity.

    If the direction changes, the path brakes to standstill first and then accelerates. The velocity
    limit is not applied.
    """
    legs = _ramps(start.velocity, velocity, _effective(limits))
    return Path(now_us, start, legs, limits.shape)


def to_position(
    now_us: int, start: Motion, target: float, limits: PathLimits, end_velocity: float = 0.0
) -> Path:
    """Plan the fastest path to a position.

    A motion that leads away from the target, or is too fast to stop there, first brakes to
    standstill and then returns. A motion above the velocity limit first brakes to that limit.

    Args:
        now_us: time at which the path begins.
        start: position and velocity at the beginning.
        target: end position.
        limits: limits of the path.
        end_velocity: speed at the target in the direction of motion, at least 0. If the path is too
            short for this speed, the speed at the target is as near to it as the limits allow.
    """
    distance = target - start.position
    legs = _legs(start.velocity, distance, _effective(limits), min(end_velocity, limits.velocity))
    return Path(now_us, start, legs, limits.shape, target)


def _effective(limits: PathLimits) -> PathLimits:
    """Return limits with the mean slope of a ramp instead of its peak."""
    if limits.shape is RampShape.LINEAR:
        return limits
    mean = 2 / pi
    return PathLimits(limits.velocity, limits.acceleration * mean, limits.deceleration * mean)


def _ramps(velocity: float, wanted: float, limits: PathLimits) -> list[_Leg]:
    if velocity * wanted < 0.0:
        return [*_ramps(velocity, 0.0, limits), *_ramps(0.0, wanted, limits)]
    speeds_up = abs(wanted) > abs(velocity)
    slope = limits.acceleration if speeds_up else limits.deceleration
    return [_Leg(wanted, abs(wanted - velocity) / slope)]


def _legs(velocity: float, distance: float, limits: PathLimits, end: float) -> list[_Leg]:
    """Return the legs of a path to a position in either direction."""
    direction = copysign(1.0, distance or velocity)
    velocity, distance = velocity * direction, distance * direction
    stopping = velocity * abs(velocity) / (2 * limits.deceleration)
    if velocity < 0.0 or (end == 0.0 and stopping > distance):
        rest = _legs(0.0, distance - stopping, limits, end)
        legs = [*_ramps(velocity, 0.0, limits), *rest]
    else:
        legs = _forward(velocity, distance, limits, end)
    return [_Leg(leg.velocity * direction, leg.duration_s) for leg in legs]


def _forward(velocity: float, distance: float, limits: PathLimits, end: float) -> list[_Leg]:
    """Return the legs of a forward path: to the top speed, at that speed, to the end velocity."""
    up, down = limits.acceleration, limits.deceleration
    slowest = sqrt(max(0.0, velocity**2 - 2 * down * distance)) if end > 0.0 else 0.0
    end = max(slowest, min(end, sqrt(velocity**2 + 2 * up * distance)))
    peak = sqrt((2 * up * down * distance + down * velocity**2 + up * end**2) / (up + down))
    top = max(end, min(limits.velocity, peak))
    legs = [*_ramps(velocity, top, limits), _Leg(top, 0.0), *_ramps(top, end, limits)]
    if top > 0.0:
        ways = (velocity + top) / 2 * legs[0].duration_s + (top + end) / 2 * legs[2].duration_s
        legs[1] = _Leg(top, max(0.0, (distance - ways) / top))
    return legs


# The reference of a drive on a planned path.


class PathFollower(Part):
    """Moves the reference of a drive along planned paths.

    Each path begins at the reference of the previous tick. If other code has changed the reference,
    the path is no longer valid: `kept` is then false, and the mode of operation has to plan a new
    path.

    Args:
        reference: the reference of the drive.
    """

    __slots__ = ("_left_at", "_path", "_reference")

    def __init__(self, reference: Reference) -> None:
        self._reference, self._path = reference, Path(0, Motion(0.0), ())
        self._left_at: tuple[float, float] | None = None

    @property
    def kept(self) -> bool:
        """Whether there is a path, and the reference is still on it."""
        return self._left_at == (self._reference.position, self._reference.velocity)

    @property
    def motion(self) -> Motion:
        """The present reference, at which a path may begin."""
        return Motion(self._reference.position, self._reference.velocity)

    def begin(self, path: Path) -> None:
        """Follow another path, which must begin at `motion`, at `began_us`."""
        self._path, self._left_at = path, (self._reference.position, self._reference.velocity)

    def leave(self) -> None:
        """Drop the path."""
        self._left_at = None

    def follow(self, now_us: int) -> bool:
        """Move the reference along the path to now; return whether the path has ended."""
        motion = self._path.at(now_us)
        self._reference.place(*motion)
        self._left_at = motion.position, motion.velocity
        return self._path.ended(now_us)


def began_us(now_us: int) -> int:
    """Return the time at which a path that is planned in this tick begins, in microseconds.

    The result is the time of the previous tick. A path begins at the demanded position and velocity
    of the drive, and these are still the values of the previous tick.
    """
    return now_us - TICK_US
