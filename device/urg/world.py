"""Parameters of a range finder, the world around it, rays and views."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from math import asin, atan2, ceil, cos, floor, hypot, inf, isfinite, isinf, sin, sqrt, tau
from typing import Final

from tickrig.device.body import Pose
from tickrig.device.chance import Chance
from tickrig.device.twin import Immutable, Part
from tickrig.wire.scip import Specification

# Parameters of a sensor; the defaults are a URG-04LX.

URG_04LX: Final = Specification(
    "URG-04LX(Hokuyo Automatic Co.,Ltd.)", 20, 5_600, 1_024, 44, 725, 384, 600
)
"""Limits as reported by the sensor (URG network, status information)."""

LAST_STEP: Final = 768
"""The highest step in a request (SCIP 2.0, measurement direction and points)."""

BIT_RATE: Final = 19_200
"""Bit rate of RS-232C after power-up, which has no meaning on USB."""


_PROTOCOLS: Final = ("1.1", "2.0")
"""Protocols after power-up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UrgParameters(Immutable):
    """Parameters of an emulated URG laser scanner: its serial number, noise and interface.

    Attributes:
        serial: serial number of letters and digits.
        noise: largest noise of a distance, as a share 0..1 of the sensor's accuracy. 0 means no
            noise. The accuracy is 10 mm for distances below 1 m, and 1 % of longer distances.
        seed: seed of the noise.
        scip: protocol after power-up: 1.1 as in the URG-04LX, whose laser is then on, or 2.0 as in
            sensors such as the URG-04LX-UG01, whose laser is then off.
        rs232_baud: bit rate of the RS-232C line after power-up, in bit/s, or None on USB.

    Raises:
        ValueError: a value is out of range.
    """

    serial: str = "H0614967"
    noise: float = 0.0
    seed: int = 0
    scip: str = "1.1"
    rs232_baud: int | None = None

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range."""
        if not (self.serial.isascii() and self.serial.isalnum()):
            raise ValueError(f"serial {self.serial!r} is not letters and digits")
        if not 0 <= self.noise <= 1:
            raise ValueError(f"noise {self.noise} is not in 0..1")
        if self.scip not in _PROTOCOLS:
            raise ValueError(f"scip {self.scip!r} is not one of {', '.join(_PROTOCOLS)}")
        if self.rs232_baud is not None and self.rs232_baud < 1:
            raise ValueError(f"rs232_baud {self.rs232_baud} bit/s is below 1")


# A flat world of walls and round posts, and the length of rays in it.

_Rays = Sequence[tuple[float, float]]
"""Directions, each a vector of length 1."""


def rays_of(angles_rad: Sequence[float]) -> _Rays:
    """Return the directions of angles."""
    return tuple(zip(map(cos, angles_rad), map(sin, angles_rad), strict=True))


@dataclass(frozen=True, slots=True)
class Wall(Immutable):
    """A straight wall between two points, in m."""

    x1_m: float
    y1_m: float
    x2_m: float
    y2_m: float

    def __post_init__(self) -> None:
        """Raise ValueError if the numbers are not a wall."""
        ends = (self.x1_m, self.y1_m, self.x2_m, self.y2_m)
        if not all(map(isfinite, ends)) or ends[:2] == ends[2:]:
            raise ValueError(f"a wall has two places that are not the same, got {ends}")

    def distances_m(self, x_m: float, y_m: float, rays: _Rays) -> list[float]:
        """Return the distance from a position along each ray to this wall, in metres.

        A ray that misses the wall has the distance infinity.
        """
        wall_x, wall_y = self.x2_m - self.x1_m, self.y2_m - self.y1_m
        off_x, off_y = self.x1_m - x_m, self.y1_m - y_m
        area = off_x * wall_y - off_y * wall_x
        return [
            area / cross
            if (cross := dx * wall_y - dy * wall_x)
            and area / cross >= 0
            and 0 <= (off_x * dy - off_y * dx) / cross <= 1
            else inf
            for dx, dy in rays
        ]


@dataclass(frozen=True, slots=True)
class Post(Immutable):
    """A round post. A radius of 0 means no post."""

    x_m: float
    y_m: float
    radius_m: float

    def __post_init__(self) -> None:
        """Raise ValueError if the numbers are not a post."""
        numbers = (self.x_m, self.y_m, self.radius_m)
        if not all(map(isfinite, numbers)) or self.radius_m < 0:
            raise ValueError(f"a post has a place and a radius of 0 or more, got {numbers}")

    def distances_m(self, x_m: float, y_m: float, rays: _Rays) -> list[float]:
        """Return the distance from a position along each ray to this post, in metres.

        A ray that misses the post has the distance infinity.
        """
        # d = (off . ray) is the distance along the ray to the point nearest to the axis. (off x
        # ray) is the distance of this point from the axis.
        off_x, off_y, most = self.x_m - x_m, self.y_m - y_m, self.radius_m**2
        return [
            _first_m(off_x * dx + off_y * dy, sqrt(inside))
            if (inside := most - (off_x * dy - off_y * dx) ** 2) > 0
            else inf
            for dx, dy in rays
        ]


@dataclass(frozen=True, slots=True)
class World(Immutable):
    """Everything that a ray can meet. Not emulated: glass, mirrors, slopes, heights."""

    walls: tuple[Wall, ...] = ()
    posts: tuple[Post, ...] = ()

    def distances_m(self, x_m: float, y_m: float, angles_rad: Iterable[float]) -> list[float]:
        """Return the distance from a position to the first object in each direction.

        >>> World((Wall(2.0, -1.0, 2.0, 1.0),)).distances_m(0.5, 0.0, [0.0])
        [1.5]
        """
        rays = rays_of(tuple(angles_rad))
        things: tuple[Wall | Post, ...] = (*self.walls, *self.posts)
        nothing = [inf] * len(rays)
        ways = [thing.distances_m(x_m, y_m, rays) for thing in things]
        return [min(column) for column in zip(nothing, *ways, strict=True)]

    def distance_m(self, x_m: float, y_m: float, angle_rad: float) -> float:
        """Return the distance from a position to the first object in one direction."""
        return self.distances_m(x_m, y_m, [angle_rad])[0]

    def with_posts(self, *posts: Post) -> World:
        """Return a world with additional posts."""
        return World(self.walls, (*self.posts, *posts))

    def clearance_m(self, x_m: float, y_m: float) -> float:
        """Return the distance to the nearest object, or infinity in an empty world."""
        posts = (hypot(p.x_m - x_m, p.y_m - y_m) - p.radius_m for p in self.posts if p.radius_m)
        walls = (_off_wall_m(wall, x_m, y_m) for wall in self.walls)
        return min((*posts, *walls), default=inf)


def room(width_m: float, depth_m: float) -> World:
    """Return a rectangular room as the surroundings of a sensor: four walls around the origin.

    Args:
        width_m: size in x, in metres.
        depth_m: size in y, in metres.

    Raises:
        ValueError: a size is not above 0.
    """
    if not (width_m > 0 and depth_m > 0):
        raise ValueError(f"a room has a width and a depth above 0, got {width_m}, {depth_m}")
    x_m, y_m = width_m / 2, depth_m / 2
    corners = ((-x_m, -y_m), (x_m, -y_m), (x_m, y_m), (-x_m, y_m))
    return World(tuple(Wall(*corners[at - 1], *corners[at]) for at in range(4)))


def _first_m(along_m: float, half_m: float) -> float:
    """Return where a ray enters a post, or where it leaves the post if it starts inside."""
    if along_m >= half_m:
        return along_m - half_m
    return along_m + half_m if along_m >= -half_m else inf


def _off_wall_m(wall: Wall, x_m: float, y_m: float) -> float:
    along_x, along_y = wall.x2_m - wall.x1_m, wall.y2_m - wall.y1_m
    share = (x_m - wall.x1_m) * along_x + (y_m - wall.y1_m) * along_y
    share = min(max(share / (along_x**2 + along_y**2), 0.0), 1.0)
    return hypot(wall.x1_m + share * along_x - x_m, wall.y1_m + share * along_y - y_m)


# All beams of a scan at once: each object is computed only for the beams that can meet it.
#
# The numbers equal those of `World.distances_m` to the bit. The outline of an object tells which
# beams certainly meet it and which may meet it; both are computed as in `World.distances_m`.

_BLUR: Final = 1e-6
"""Distance, relative to the size of an object, below which it is computed for all beams."""

_Span = tuple[int, int]
"""The first beam, and the beam after the last."""


class Beams(Part):
    """The laser beams of a scan from one position, in the order from right to left.

    Args:
        x_m: position of the sensor in x, in metres.
        y_m: position of the sensor in y, in metres.
        rays: directions of the beams as unit vectors. From each beam to the next, the direction
            turns to the left by `tau / turn` radians.
        first_rad: direction of the first beam in radians. It may be more than one full turn, but at
            most 2e6 radians in each direction.
        turn: number of beams in a full turn. `rays` has at most this number.
    """

    def __init__(self, x_m: float, y_m: float, rays: _Rays, first_rad: float, turn: int) -> None:
        self._x_m, self._y_m, self._turn = x_m, y_m, turn
        self._rays, self._first_rad = rays, first_rad
        self._ways_m = [inf] * len(self._rays)

    def cast_m(self, world: World) -> list[float]:
        """Return the distance along each beam to the nearest object of the surroundings, in metres.

        A beam that meets no object has the distance infinity.
        """
        self._ways_m = [inf] * len(self._rays)
        for wall in world.walls:
            self._meet_wall(wall)
        for post in world.posts:
            self._meet_post(post)
        return self._ways_m

    def _meet_wall(self, wall: Wall) -> None:
        wall_x, wall_y = wall.x2_m - wall.x1_m, wall.y2_m - wall.y1_m
        off_x, off_y = wall.x1_m - self._x_m, wall.y1_m - self._y_m
        end_x, end_y = off_x + wall_x, off_y + wall_y
        area = off_x * wall_y - off_y * wall_x
        # Compare the area of the triangle of sensor and wall with its sides: if it is near 0, the
        # sensor stands on the line of the wall. Then the angles of the wall's ends do not tell
        # which beams meet the wall.
        size = hypot(wall_x, wall_y) * (hypot(off_x, off_y) + hypot(end_x, end_y))
        if not abs(area) > _BLUR * size:
            self._measure(wall, (0, len(self._rays)))
            return
        right, left = atan2(off_y, off_x), atan2(end_y, end_x)
        if area < 0:
            right, left = left, right
        first, last = self._places(right, (left - right) % tau)
        # One beam of margin at each end: the beams between are sure to meet the wall. The beams in
        # the margin are computed in full. So the numbers equal those of `World.distances_m` to the
        # bit.
        sure = ceil(first + 1), floor(last - 1) + 1
        if sure[0] >= sure[1]:
            self._measure_some(wall, (ceil(first - 1), floor(last + 1) + 1))
            return
        self._measure_some(wall, (ceil(first - 1), sure[0]))
        self._measure_some(wall, (sure[1], floor(last + 1) + 1))
        for begin, end in self._here(sure):
            rays = self._rays[begin:end]
            self._put(begin, end, [area / (dx * wall_y - dy * wall_x) for dx, dy in rays])

    def _meet_post(self, post: Post) -> None:
        off_x, off_y, radius_m = post.x_m - self._x_m, post.y_m - self._y_m, post.radius_m
        off_m = hypot(off_x, off_y)
        if not off_m > radius_m * (1 + _BLUR):
            self._measure(post, (0, len(self._rays)))
            return
        half_rad = asin(radius_m / off_m)
        first, last = self._places(atan2(off_y, off_x) - half_rad, 2 * half_rad)
        self._measure_some(post, (ceil(first - 1), floor(last + 1) + 1))

    def _places(self, right_rad: float, width_rad: float) -> tuple[float, float]:
        """Return start and end of an angle, counted in beams."""
        first = (right_rad - self._first_rad) % tau / tau * self._turn
        return first, first + width_rad / tau * self._turn

    def _here(self, span: _Span) -> Iterator[_Span]:
        """Yield the parts of a span within the beams; the span may be counted in any turn."""
        # A span is counted from the first beam, modulo a turn. It may begin before the first of our
        # beams or end after the last one.
        for turns in (-self._turn, 0, self._turn):
            begin, end = max(span[0] + turns, 0), min(span[1] + turns, len(self._rays))
            if begin < end:
                yield begin, end

    def _measure_some(self, thing: Wall | Post, span: _Span) -> None:
        for here in self._here(span):
            self._measure(thing, here)

    def _measure(self, thing: Wall | Post, span: _Span) -> None:
        begin, end = span
        self._put(begin, end, thing.distances_m(self._x_m, self._y_m, self._rays[begin:end]))

    def _put(self, begin: int, end: int, ways_m: list[float]) -> None:
        """Keep the nearer distances."""
        before = self._ways_m[begin:end]
        if before.count(inf) < len(before):
            ways_m = list(map(min, before, ways_m))
        self._ways_m[begin:end] = ways_m


# The view of a sensor in one scan.

_HALF: Final = 2.0**63


class _NoDistance(IntEnum):
    """Numbers below DMIN that are codes, not distances (SCIP 2.0, error codes)."""

    WEAK = 1
    OTHER = 6
    NOT_MEASURABLE = 19


@dataclass(frozen=True, slots=True)
class View(Immutable):
    """One scan of a sensor. The distances are computed when they are requested.

    The sensor is assumed not to move during a scan, and a beam is a line without width. The angle
    of incidence and the colour and gloss of objects have no effect.

    Attributes:
        number: number of the scan since power-up.
        time_ms: timer of the sensor when the scan began.
        pose: pose of the sensor when the scan ended.
        world: the surroundings when the scan ended.
        kind: range, steps and speed of the sensor model.
        parameters: noise and seed.
    """

    number: int
    time_ms: int
    pose: Pose
    world: World
    kind: Specification
    parameters: UrgParameters

    def distances(self, first: int, last: int, cluster: int) -> tuple[int, ...]:
        """Return the distances of a range of steps in mm: the least distance of each cluster.

        A step is one direction of the scan, and a cluster is a group of consecutive steps. If no
        step of a cluster has a distance, the result contains the error code of the first step of
        this cluster instead. Steps after the last whole cluster are ignored (DECISION U11).

        Args:
            first: first step.
            last: last step.
            cluster: number of steps in a cluster.
        """
        kind, ways_m = self.kind, self._ways_m(range(first, last + 1))
        measurable = kind.first <= first and last <= kind.last
        # Rounding before or after taking the least of a cluster gives the same number, if no
        # distance in the cluster is below DMIN. Such a distance would be a code, and codes are not
        # distances.
        if measurable and cluster > 1:  # round once a cluster: a third of the time of a scan
            least_m = _least_of_each(ways_m, cluster)
            if kind.nearest_mm / 1_000 <= min(least_m, default=inf):
                return tuple(self._numbers(least_m))
        numbers = self._numbers(ways_m)
        if not measurable:
            numbers = [
                number if kind.first <= step <= kind.last else _NoDistance.NOT_MEASURABLE
                for step, number in enumerate(numbers, first)
            ]
        if cluster <= 1:
            return tuple(numbers)
        places = range(0, len(numbers) - cluster + 1, cluster)
        return tuple(self._least(numbers[at : at + cluster]) for at in places)

    def _least(self, numbers: Sequence[int]) -> int:
        good = [number for number in numbers if number >= self.kind.nearest_mm]
        return min(good, default=numbers[0])

    def _ways_m(self, steps: range) -> list[float]:
        """Return the distance in the direction of each step, with the noise of the sensor."""
        kind, pose = self.kind, self.pose
        rays, first_rad = _rays(kind, steps, pose.heading_rad)
        ways_m = Beams(pose.x_m, pose.y_m, rays, first_rad, kind.resolution).cast_m(self.world)
        if not self.parameters.noise:
            return ways_m
        return [
            way_m if isinf(way_m) else way_m + self._error_mm(step, way_m) / 1_000
            for step, way_m in zip(steps, ways_m, strict=True)
        ]

    def _numbers(self, ways_m: Sequence[float]) -> list[int]:
        """Return distances in mm, and codes."""
        near_m, far_m = self.kind.nearest_mm / 1_000, self.kind.farthest_mm / 1_000
        weak, other = int(_NoDistance.WEAK), int(_NoDistance.OTHER)
        return [
            weak if way_m > far_m else other if way_m < near_m else round(way_m * 1_000)
            for way_m in ways_m
        ]

    def _error_mm(self, step: int, distance_m: float) -> float:
        """Return the noise of a step: uniform, and the same for each call."""
        most_mm = self.parameters.noise * max(10.0, distance_m * 10)
        chance = Chance(self.parameters.seed, f"{self.number} {step}")
        return most_mm * (chance.draw() / _HALF - 1)


@lru_cache(maxsize=8)
def _off_rad(kind: Specification, steps: range) -> tuple[float, ...]:
    """Return the directions of steps from straight ahead; cached, because each scan needs them."""
    return tuple((step - kind.front) * tau / kind.resolution for step in steps)


@lru_cache(maxsize=8)  # a robot that stands or goes straight: a third of the time of a scan
def _rays(kind: Specification, steps: range, heading_rad: float) -> tuple[_Rays, float]:
    """Return the directions of the beams of steps, and the angle of the first beam."""
    angles_rad = [heading_rad + off_rad for off_rad in _off_rad(kind, steps)]
    return rays_of(angles_rad), angles_rad[0] if angles_rad else 0.0


def _least_of_each(ways_m: Sequence[float], cluster: int) -> list[float]:
    """Return the least number of each whole cluster."""
    end = len(ways_m) - len(ways_m) % cluster
    return list(map(min, *(ways_m[at:end:cluster] for at in range(cluster))))
