"""The numbers of a scan are what each step says by itself."""

from __future__ import annotations

from math import tau

from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.body import Pose
from tickrig.device.urg.world import LAST_STEP, URG_04LX, Post, UrgParameters, View, World, room

KIND = URG_04LX


def number(view: View, step: int) -> int:
    """Return what a step says, without noise."""
    if not KIND.first <= step <= KIND.last:
        return 19
    angle_rad = view.pose.heading_rad + (step - KIND.front) * tau / KIND.resolution
    way_m = view.world.distance_m(view.pose.x_m, view.pose.y_m, angle_rad)
    if way_m > 5.6:
        return 1
    return 6 if way_m < 0.02 else round(way_m * 1_000)


def clustered(numbers: list[int], cluster: int) -> tuple[int, ...]:
    """Return the least distance of each whole cluster, or else the first code."""
    heads = range(0, len(numbers) - cluster + 1, cluster)
    each = [numbers[head : head + cluster] for head in heads]
    return tuple(min([n for n in some if n >= KIND.nearest_mm], default=some[0]) for some in each)


@st.composite
def views(draw: st.DrawFn) -> View:
    place = st.floats(-3, 3)
    pose = Pose(draw(place), draw(place), draw(st.floats(-7, 7)))
    post = Post(pose.x_m + draw(st.floats(0.01, 3)), pose.y_m, draw(st.floats(0, 1)))
    world = draw(st.sampled_from([World(), room(4, 3), room(12, 12)]))
    return View(7, 700, pose, world.with_posts(post), KIND, UrgParameters())


@given(views(), st.integers(0, LAST_STEP), st.integers(0, 60), st.integers(0, 12))
def test_a_number_is_that_of_its_steps(view: View, first: int, more: int, cluster: int) -> None:
    steps = range(first, min(first + more, LAST_STEP) + 1)
    numbers = [number(view, step) for step in steps]
    assert view.distances(steps[0], steps[-1], cluster) == clustered(numbers, max(cluster, 1))


@given(views(), st.integers(1, 5))
def test_a_cluster_of_a_noisy_scan_is_that_of_its_steps(view: View, cluster: int) -> None:
    noisy = View(7, 700, view.pose, view.world, KIND, UrgParameters(noise=1.0, seed=3))
    numbers = [*noisy.distances(KIND.first, KIND.last, 1)]
    assert noisy.distances(KIND.first, KIND.last, cluster) == clustered(numbers, cluster)
