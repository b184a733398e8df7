"""All beams of a scan at once: each thing is asked only for the beams that can meet it.

Numbers are those of `World.distances_m` to the bit: a thing tells from its outline which beams
meet it for certain and which may, and both are computed as there.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import asin, atan2, ceil, floor, hypot, inf, tau
from typing import Final

from tickrig.device.twin import Part
from tickrig.device.urg.world import Post, Rays, Wall, World

BLUR: Final = 1e-6
"""From nearer than so much of its size a thing is asked for all beams: its angles are vague."""

Span = tuple[int, int]
"""The first beam and the one behind the last."""


class Beams(Part):
    """Beams from a place, evenly spaced to the left.

    Args:
        x_m: of the place.
        y_m: of the place.
        rays: where they go, each `tau / turn` beyond the one before.
        first_rad: where the first goes; within 2e6.
        turn: how many there are in a whole turn; there are no more here.
    """

    def __init__(self, x_m: float, y_m: float, rays: Rays, first_rad: float, turn: int) -> None:
        self._x_m, self._y_m, self._turn = x_m, y_m, turn
        self._rays, self._first_rad = rays, first_rad
        self._ways_m = [inf] * len(self._rays)

    def cast_m(self, world: World) -> list[float]:
        """Return how far each goes until it meets something, infinity if it does not."""
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
        size = hypot(wall_x, wall_y) * (hypot(off_x, off_y) + hypot(end_x, end_y))
        if not abs(area) > BLUR * size:
            self._measure(wall, (0, len(self._rays)))
            return
        right, left = atan2(off_y, off_x), atan2(end_y, end_x)
        if area < 0:
            right, left = left, right
        first, last = self._places(right, (left - right) % tau)
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
        if not off_m > radius_m * (1 + BLUR):
            self._measure(post, (0, len(self._rays)))
            return
        half_rad = asin(radius_m / off_m)
        first, last = self._places(atan2(off_y, off_x) - half_rad, 2 * half_rad)
        self._measure_some(post, (ceil(first - 1), floor(last + 1) + 1))

    def _places(self, right_rad: float, width_rad: float) -> tuple[float, float]:
        """Return where an angle begins and ends, counted in beams."""
        first = (right_rad - self._first_rad) % tau / tau * self._turn
        return first, first + width_rad / tau * self._turn

    def _here(self, span: Span) -> Iterator[Span]:
        """Yield which of ours a span is, wherever in which turn it was counted."""
        for turns in (-self._turn, 0, self._turn):
            begin, end = max(span[0] + turns, 0), min(span[1] + turns, len(self._rays))
            if begin < end:
                yield begin, end

    def _measure_some(self, thing: Wall | Post, span: Span) -> None:
        for here in self._here(span):
            self._measure(thing, here)

    def _measure(self, thing: Wall | Post, span: Span) -> None:
        begin, end = span
        self._put(begin, end, thing.distances_m(self._x_m, self._y_m, self._rays[begin:end]))

    def _put(self, begin: int, end: int, ways_m: list[float]) -> None:
        """Keep what is nearer."""
        before = self._ways_m[begin:end]
        if before.count(inf) < len(before):
            ways_m = list(map(min, before, ways_m))
        self._ways_m[begin:end] = ways_m
