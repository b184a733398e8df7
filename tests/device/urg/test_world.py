from __future__ import annotations

from math import cos, hypot, inf, nan, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.urg.world import Post, Wall, World, room

numbers = st.floats(-20, 20)
angles = st.floats(-10, 10)


def test_a_ray_meets_the_nearest_thing() -> None:
    world = World((Wall(3, -1, 3, 1), Wall(2, -1, 2, 1)), (Post(5, 0, 1),))
    assert world.distance_m(0, 0, 0) == 2
    assert world.distance_m(2.5, 0, 0) == 0.5
    assert world.distance_m(3.5, 0, 0) == 0.5


@pytest.mark.parametrize("angle_rad", [pi, pi / 2, -pi / 2, 0.5])
def test_a_ray_that_meets_nothing_has_no_end(angle_rad: float) -> None:
    assert World((Wall(2, -1, 2, 1),), (Post(3, 0, 0.5),)).distance_m(0, 0, angle_rad) == inf


def test_a_wall_is_seen_at_a_slant() -> None:
    assert room(4, 4).distance_m(0, 0, pi / 4) == pytest.approx(hypot(2, 2))


def test_from_within_a_post_its_inside_is_seen() -> None:
    assert World(posts=(Post(1, 0, 2),)).distance_m(0, 0, 0) == 3


def test_a_post_behind_is_not_seen() -> None:
    assert World(posts=(Post(-3, 0, 1),)).distance_m(0, 0, 0) == inf


@given(numbers, numbers, st.floats(0.01, 5), angles)
def test_where_a_ray_ends_is_the_rim_of_a_post(x: float, y: float, r: float, angle: float) -> None:
    way = World(posts=(Post(x, y, r),)).distance_m(0, 0, angle)
    if way < inf:
        assert hypot(way * cos(angle) - x, way * sin(angle) - y) == pytest.approx(r, abs=1e-5)


@given(st.floats(-1.9, 1.9), st.floats(-2.9, 2.9), angles)
def test_in_a_room_every_ray_ends_at_a_wall(x: float, y: float, angle: float) -> None:
    way = room(4, 6).distance_m(x, y, angle)
    end_x, end_y = x + way * cos(angle), y + way * sin(angle)
    assert max(abs(end_x) - 2, abs(end_y) - 3) == pytest.approx(0, abs=1e-9)


def test_clearance_is_the_way_to_the_nearest_thing() -> None:
    world = World((Wall(2, -1, 2, 1),)).with_posts(Post(-3, 0, 0.5), Post(0, 0, 0))
    assert world.clearance_m(0, 0) == 2
    assert world.clearance_m(-2, 0) == 0.5
    assert world.clearance_m(2, 3) == 2
    assert World().clearance_m(0, 0) == inf


@pytest.mark.parametrize("ends", [(1, 1, 1, 1), (0, 0, nan, 1), (0, inf, 0, 1)])
def test_a_wall_that_is_none_is_refused(ends: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="a wall has two places"):
        Wall(*ends)


@pytest.mark.parametrize("numbers", [(0, 0, -1), (nan, 0, 1), (0, 0, inf)])
def test_a_post_that_is_none_is_refused(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="a post has a place and a radius"):
        Post(*numbers)


@pytest.mark.parametrize("size", [(0, 1), (1, -1), (nan, 1)])
def test_a_room_that_is_none_is_refused(size: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="a room has a width and a depth above 0"):
        room(*size)
