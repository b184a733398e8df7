"""Which markers a reader hears."""

from __future__ import annotations

from math import nan, pi

import pytest

from tickrig.device.body import Pose
from tickrig.device.ucode_reader import Marker, ReaderParameters, Reception, receive

READER = ReaderParameters(range_m=4.0, cone_deg=90)
NEAR, FAR, BESIDE, BEHIND, AWAY = markers = [
    Marker(f"{number:032X}", x_m, y_m)
    for number, (x_m, y_m) in enumerate([(1, 0), (3, 3 - 0.5), (1, 1.1), (-1, 0), (4.1, 0)])
]


def names(pose: Pose, share: float = 1.0, parameters: ReaderParameters = READER) -> list[int]:
    return [int(reception.ucode, 16) for reception in receive(markers, pose, parameters, share)]


def test_those_in_cone_and_range_are_heard_the_nearest_first() -> None:
    assert names(Pose()) == [0, 1]
    assert receive([NEAR], Pose(), READER) == (Reception(NEAR.ucode, 75),)


def test_where_it_looks_is_the_heading_of_the_body() -> None:
    assert names(Pose(0, 0, pi)) == [3]
    assert names(Pose(0, 0, -3 * pi)) == [3]
    assert names(Pose(0, 0, pi / 4 + 0.01)) == [2, 1]


def test_where_it_stands_is_the_place_of_the_body() -> None:
    assert names(Pose(0.2, 0, 0)) == [0, 1, 4]
    assert names(Pose(50, 0, pi)) == []


def test_a_marker_at_the_reader_is_always_received() -> None:
    assert receive([NEAR], Pose(1, 0, 2), READER) == (Reception(NEAR.ucode, 100),)


def test_the_level_is_1_at_least() -> None:
    assert receive([Marker(NEAR.ucode, 4, 0)], Pose(), READER) == (Reception(NEAR.ucode, 1),)


def test_markers_of_one_distance_come_in_the_order_of_their_ucodes() -> None:
    pair = [Marker(f"{2:032X}", 1, 0.2), Marker(f"{1:032X}", 1, -0.2)]
    assert [reception.ucode[-1] for reception in receive(pair, Pose(), READER)] == ["1", "2"]


def test_a_dirty_window_takes_range() -> None:
    assert names(Pose(), 0.5) == [0]


def test_a_whole_turn_hears_all_around() -> None:
    assert names(Pose(), 1.0, ReaderParameters(range_m=4.2, cone_deg=360)) == [0, 3, 2, 1, 4]


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"range_m": 0.0}, r"range_m 0.0 is not in 0.1..99 m"),
        ({"range_m": nan}, "range_m nan"),
        ({"cone_deg": 361}, r"cone_deg 361 is not in 1..360 degrees"),
    ],
)
def test_a_reader_that_cannot_be_is_refused(settings: dict[str, float], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        ReaderParameters(**settings)  # type: ignore[arg-type]


def test_a_marker_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="a marker has a place, got nan"):
        Marker("0" * 32, nan, 0)
    with pytest.raises(ValueError, match="is not 32 hex digits"):
        Marker("0", 0, 0)
    with pytest.raises(ValueError, match="is not written in capitals"):
        Marker("a" * 32, 0, 0)
