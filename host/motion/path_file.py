"""A path in a text file: a point a line, `x y` or `x y heading`, in metres and radians."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.ports import plausible

FARTHEST_M: Final = 1_000
"""A goal farther than this from the start is a slip of the pen: it takes an hour."""


def within_reach(goal: Pose) -> bool:
    """Return whether a goal is so near that somebody may mean it."""
    return goal.distance(Pose()) <= FARTHEST_M


def read_path(path: Path) -> list[Pose]:
    """Return the points; `#` begins a comment, commas count as spaces.

    Raises:
        OSError: the file cannot be read.
        ValueError: a line that is no point, or no point at all; it says which.
    """
    points = []
    for number, line in enumerate(path.read_text("utf-8", "replace").splitlines(), 1):
        if words := line.partition("#")[0].replace(",", " ").split():
            points.append(_point(f"{path}:{number}", words))
    if not points:
        raise ValueError(f"{path} has no point; a line has x and y in metres")
    return points


def _point(place: str, words: list[str]) -> Pose:
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not plausible(*numbers):
        text = " ".join(words)
        raise ValueError(f"{place}: {text!r} is not x y in metres, and a heading in radians")
    if not within_reach(point := Pose(*numbers)):
        raise ValueError(f"{place}: {' '.join(words)!r} is beyond {FARTHEST_M} m")
    return point
