"""Casting all beams at once gives what each gives by itself, to the bit."""

from __future__ import annotations

from math import atan2, tau
from struct import pack

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tickrig.device.urg.world import Beams, Post, Wall, World, rays_of, room

TURN = 1_024
OFF_RAD = [(step - 384) * tau / TURN for step in range(44, 726)]
ALL_ROUND = [step * tau / TURN for step in range(TURN)]

places = st.one_of(st.floats(-10, 10), st.integers(-4, 4).map(float), st.floats(-1e-6, 1e-6))
walls = (
    st.tuples(places, places, places, places)
    .filter(lambda ends: ends[:2] != ends[2:])
    .map(lambda ends: Wall(*ends))
)
posts = st.builds(Post, places, places, places.map(abs))
worlds = st.builds(
    lambda walls, posts, size: World((*walls, *(room(*size).walls if size else ())), tuple(posts)),
    st.lists(walls, max_size=5),
    st.lists(posts, max_size=3),
    st.none() | st.tuples(st.floats(0.5, 12), st.floats(0.5, 12)),
)
headings = st.one_of(
    st.floats(-10, 10), st.sampled_from([0.0, tau / 4, -tau / 2]), st.floats(-1e6, 1e6)
)


def beams(x_m: float, y_m: float, angles_rad: list[float]) -> Beams:
    return Beams(x_m, y_m, rays_of(angles_rad), angles_rad[0] if angles_rad else 0.0, TURN)


def check(world: World, x_m: float, y_m: float, angles_rad: list[float]) -> None:
    cast_m = beams(x_m, y_m, angles_rad).cast_m(world)
    plain_m = world.distances_m(x_m, y_m, angles_rad)
    assert pack(f"{len(cast_m)}d", *cast_m) == pack(f"{len(plain_m)}d", *plain_m)


@given(worlds, places, places, headings)
@example(World((Wall(0, -1, 0, 1),), (Post(0, 0, 0),)), 0.0, 0.0, 0.0)
@example(World((Wall(1, 0, 2, 0), Wall(-2, 0, -1, 0))), 0.0, 0.0, 0.0)
def test_a_scan_is_that_of_each_beam(world: World, x_m: float, y_m: float, heading: float) -> None:
    check(world, x_m, y_m, [heading + off_rad for off_rad in OFF_RAD])


@given(worlds, places, places, headings)
def test_a_whole_turn_is_that_of_each_beam(
    world: World, x_m: float, y_m: float, heading: float
) -> None:
    check(world, x_m, y_m, [heading + off_rad for off_rad in ALL_ROUND])


@given(walls, st.floats(-2, 3), st.sampled_from([0.0, 1e-9, 1e-7, -1e-5, 1e-3]))
def test_on_and_beside_a_wall(wall: Wall, share: float, beside_m: float) -> None:
    x_m = wall.x1_m + share * (wall.x2_m - wall.x1_m) + beside_m
    y_m = wall.y1_m + share * (wall.y2_m - wall.y1_m)
    towards = atan2(wall.y1_m - y_m, wall.x1_m - x_m)
    check(World((wall,)), x_m, y_m, [towards + off_rad for off_rad in OFF_RAD])


@given(posts, headings, st.sampled_from([0.5, 1.0, 1.0 + 1e-9, 1.0 + 1e-6, 1.0 + 1e-4]))
def test_within_and_beside_a_post(post: Post, heading: float, share: float) -> None:
    angles_rad = [heading + off_rad for off_rad in OFF_RAD]
    check(World(posts=(post,)), post.x_m + share * post.radius_m, post.y_m, angles_rad)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_beams(count: int) -> None:
    check(room(4, 3), 0.5, 0.25, OFF_RAD[:count])


def test_most_beams_of_a_room_are_not_asked_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = list[int]()
    plain = Wall.distances_m

    def count(wall: Wall, x_m: float, y_m: float, rays: list[tuple[float, float]]) -> list[float]:
        counted.append(len(rays))
        return plain(wall, x_m, y_m, rays)

    monkeypatch.setattr(Wall, "distances_m", count)
    beams(0.2, 0.1, OFF_RAD).cast_m(room(4, 3))
    assert sum(counted) <= 4 * 4
