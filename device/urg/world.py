"""A flat world of walls and round posts, and how far a ray goes in it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import cos, hypot, inf, isfinite, sin, sqrt

from tickrig.device.twin import Immutable

Rays = Sequence[tuple[float, float]]
"""Directions, each a vector of length 1."""


def rays_of(angles_rad: Sequence[float]) -> Rays:
    """Return where angles point."""
    return tuple(zip(map(cos, angles_rad), map(sin, angles_rad), strict=True))


@dataclass(frozen=True, slots=True)
class Wall(Immutable):
    """A straight wall between two places, in m."""

    x1_m: float
    y1_m: float
    x2_m: float
    y2_m: float

    def __post_init__(self) -> None:
        """Refuse what is no wall."""
        ends = (self.x1_m, self.y1_m, self.x2_m, self.y2_m)
        if not all(map(isfinite, ends)) or ends[:2] == ends[2:]:
            raise ValueError(f"a wall has two places that are not the same, got {ends}")

    def distances_m(self, x_m: float, y_m: float, rays: Rays) -> list[float]:
        """Return how far each ray goes until it meets the wall, infinity if it does not."""
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
    """A round post; with a radius of 0 it is not there."""

    x_m: float
    y_m: float
    radius_m: float

    def __post_init__(self) -> None:
        """Refuse what is no post."""
        numbers = (self.x_m, self.y_m, self.radius_m)
        if not all(map(isfinite, numbers)) or self.radius_m < 0:
            raise ValueError(f"a post has a place and a radius of 0 or more, got {numbers}")

    def distances_m(self, x_m: float, y_m: float, rays: Rays) -> list[float]:
        """Return how far each ray goes until it meets the post, infinity if it does not."""
        off_x, off_y, most = self.x_m - x_m, self.y_m - y_m, self.radius_m**2
        return [
            _first_m(off_x * dx + off_y * dy, sqrt(inside))
            if (inside := most - (off_x * dy - off_y * dx) ** 2) > 0
            else inf
            for dx, dy in rays
        ]


@dataclass(frozen=True, slots=True)
class World(Immutable):
    """All that a ray can meet. Not there: glass, mirrors, slopes, anything with a height."""

    walls: tuple[Wall, ...] = ()
    posts: tuple[Post, ...] = ()

    def distances_m(self, x_m: float, y_m: float, angles_rad: Iterable[float]) -> list[float]:
        """Return how far it is from a place to the first thing in each direction.

        >>> World((Wall(2.0, -1.0, 2.0, 1.0),)).distances_m(0.5, 0.0, [0.0])
        [1.5]
        """
        rays = rays_of(tuple(angles_rad))
        things: tuple[Wall | Post, ...] = (*self.walls, *self.posts)
        nothing = [inf] * len(rays)
        ways = [thing.distances_m(x_m, y_m, rays) for thing in things]
        return [min(column) for column in zip(nothing, *ways, strict=True)]

    def distance_m(self, x_m: float, y_m: float, angle_rad: float) -> float:
        """Return how far it is from a place to the first thing in one direction."""
        return self.distances_m(x_m, y_m, [angle_rad])[0]

    def with_posts(self, *posts: Post) -> World:
        """Return a world with more posts."""
        return World(self.walls, (*self.posts, *posts))

    def clearance_m(self, x_m: float, y_m: float) -> float:
        """Return how far the nearest thing is from a place, infinity in an empty world."""
        posts = (hypot(p.x_m - x_m, p.y_m - y_m) - p.radius_m for p in self.posts if p.radius_m)
        walls = (_off_wall_m(wall, x_m, y_m) for wall in self.walls)
        return min((*posts, *walls), default=inf)


def room(width_m: float, depth_m: float) -> World:
    """Return four walls around the origin; ValueError for a size that is no size."""
    if not (width_m > 0 and depth_m > 0):
        raise ValueError(f"a room has a width and a depth above 0, got {width_m}, {depth_m}")
    x_m, y_m = width_m / 2, depth_m / 2
    corners = ((-x_m, -y_m), (x_m, -y_m), (x_m, y_m), (-x_m, y_m))
    return World(tuple(Wall(*corners[at - 1], *corners[at]) for at in range(4)))


def _first_m(along_m: float, half_m: float) -> float:
    """Return where a ray enters a post; where it leaves it, if it begins within."""
    if along_m >= half_m:
        return along_m - half_m
    return along_m + half_m if along_m >= -half_m else inf


def _off_wall_m(wall: Wall, x_m: float, y_m: float) -> float:
    along_x, along_y = wall.x2_m - wall.x1_m, wall.y2_m - wall.y1_m
    share = (x_m - wall.x1_m) * along_x + (y_m - wall.y1_m) * along_y
    share = min(max(share / (along_x**2 + along_y**2), 0.0), 1.0)
    return hypot(wall.x1_m + share * along_x - x_m, wall.y1_m + share * along_y - y_m)
