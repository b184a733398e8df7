"""Goals and paths as text, in a file with metres and radians, or typed with metres and degrees."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, radians
from pathlib import Path
from typing import Final

from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.ports import plausible

FARTHEST_M: Final = 1_000
"""Distance in m above which a goal is a mistake, because it takes an hour."""


def within_reach(goal: Pose) -> bool:
    """Return whether a goal is near enough to be plausible."""
    return goal.distance(Pose()) <= FARTHEST_M


def read_path(path: Path) -> list[Pose]:
    """Read the points of a path from a text file, one point per line.

    A line has x and y in metres, and optionally the heading in radians. `#` begins a comment, and
    commas count as spaces.

    Raises:
        ValueError: the file cannot be read, a line is not a point (the message has the line), or
            the file has no points.
    """
    try:
        text = path.read_text("utf-8", "replace")
    except OSError as error:
        raise ValueError(f"path {path}: {error.strerror or error}") from None
    points = []
    for number, line in enumerate(text.splitlines(), 1):
        if words := (said := line.partition("#")[0].strip()).replace(",", " ").split():
            points.append(_point(f"{path}:{number}", said, words))
    if not points:
        raise ValueError(f"{path} has no point; a line has x and y in metres")
    return points


def parse_points(text: str) -> list[Pose]:
    """Return the points of a typed text, in which commas separate the points.

    >>> parse_points("2 0, 2 2 90")[0]
    Pose(x=2.0, y=0.0, heading=0.0)

    Raises:
        ValueError: a part is not a point. The message has this part.
    """
    points = [part.split() for part in text.split(",")]
    return [in_degrees(_numbers(words), " ".join(words)) for words in points]


def in_degrees(numbers: Sequence[float], text: str) -> Pose:
    """Return a pose from numbers that a user typed: x and y in metres, heading in degrees.

    Args:
        numbers: two or three numbers. Without a third number, the heading is 0.
        text: text that the user typed, for messages.

    Raises:
        ValueError: there are not two or three numbers, a number is invalid, or the pose is more
            than `FARTHEST_M` metres from the origin.
    """
    if len(numbers) not in (2, 3) or not plausible(*numbers):
        raise ValueError(f"{text!r} is not X Y in metres, and a heading in degrees")
    x, y, heading = (*numbers, 0.0)[:3]
    if not within_reach(pose := Pose(x, y, radians(heading))):
        raise ValueError(f"{text!r} is beyond {FARTHEST_M} m")
    return pose


def describe_pose(pose: Pose) -> str:
    """Describe a pose in metres and degrees."""
    return f"{pose.x:.3f} {pose.y:.3f} m, {degrees(pose.heading):.1f} deg"


def _point(place: str, text: str, words: list[str]) -> Pose:
    numbers = _numbers(words)
    if len(numbers) not in (2, 3) or not plausible(*numbers):
        raise ValueError(f"{place}: {text!r} is not x y in metres, and a heading in radians")
    if not within_reach(point := Pose(*numbers)):
        raise ValueError(f"{place}: {text!r} is beyond {FARTHEST_M} m")
    return point


def _numbers(words: Sequence[str]) -> list[float]:
    """Return words as numbers, or none if one of them is not a number."""
    try:
        return [float(word) for word in words]
    except ValueError:
        return []
