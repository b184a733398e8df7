"""`tickrig demo rh3`, `beego`, `fourx`: one robot at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import radians
from pathlib import Path

import pytest

from tickrig.emulators.demos import robots, tracks
from tickrig.host.rtc.motion.geometry import Pose, wrap

EXAMPLES = Path(__file__).parents[3] / "examples"
WHEELED = (robots.drive_beego, robots.drive_fourx)


@cache
def driven(
    drive: Callable[[Callable[[str], None]], tracks.RobotTrack],
) -> tuple[tracks.RobotTrack, tuple[str, ...]]:
    lines: list[str] = []
    return drive(lines.append), tuple(lines)


@pytest.mark.parametrize("drive", WHEELED)
def test_what_a_robot_thinks_is_where_it_is(
    drive: Callable[[Callable[[str], None]], tracks.RobotTrack],
) -> None:
    _, (head, *rows) = driven(drive)
    assert (
        head.split()
        == (
            f"time s joystick % {driven(drive)[0].name} is at x, y, m, deg thinks x, y, m, deg"
        ).split()
    )
    assert len(rows) == 16
    for row in rows:
        _, _, _, x, y, deg, thinks_x, thinks_y, thinks_deg = map(float, row.split())
        assert Pose(x, y).distance(Pose(thinks_x, thinks_y)) < 0.02
        assert abs(wrap(radians(deg - thinks_deg))) < radians(1.5)


@pytest.mark.parametrize("drive", WHEELED)
def test_a_robot_drives_where_its_joystick_leads_it(
    drive: Callable[[Callable[[str], None]], tracks.RobotTrack],
) -> None:
    samples = driven(drive)[0].looks
    assert len(samples) == 160
    for sample in samples:
        assert sample.planned is not None
        assert sample.pose.distance(sample.planned) < 0.1  # it accelerates
    speeds = list(driven(drive)[0].speeds())
    assert max(v for _, v, _ in speeds) == pytest.approx(0.3, abs=0.01)
    assert min(w for _, _, w in speeds) == pytest.approx(-1.0, abs=0.02)


def test_a_cart_drives_to_a_goal_and_along_a_path() -> None:
    track, lines = driven(robots.drive_rh3)
    assert [line for line in lines if line.startswith("Position")] == [
        "PositionInput sends a goal.",
        "PositionInput sends its path.",
    ]
    assert sum("limits       kept" in line for line in lines) == 2
    for corner in track.planned:
        assert min(sample.pose.distance(corner) for sample in track.looks) < 0.05
    assert track.looks[-1].pose.distance(track.planned[-1]) < 0.05


@pytest.mark.parametrize("name", ["beego", "fourx"])
def test_the_examples_are_those_that_an_installation_has(name: str) -> None:
    here = Path(robots.__file__).parent
    for example in (EXAMPLES / "rigs" / f"{name}.toml", EXAMPLES / "rtc_canopen" / f"{name}.yaml"):
        assert example.read_bytes() == (here / example.name).read_bytes()
