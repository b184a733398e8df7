"""Motions of robots in a demonstration as a picture: planned and driven paths, and speeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, nan, sin
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.emulators.commands.picture import new_figure
from tickrig.host.rtc.motion.geometry import Pose, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOK_US: Final = 100_000
"""Period of the samples."""

_COLOURS: Final = ("tab:blue", "tab:orange", "tab:green", "tab:red")
_NEVER: Final = Pose(nan, nan, nan)
"""Pose that interrupts a line of the picture."""


class RobotSample(NamedTuple):
    """Pose of a robot at one time of a recorded run.

    Attributes:
        time_s: time since the start of the run, in s.
        pose: true pose of the robot.
        planned: pose that the robot was commanded to have, or None if there was no command.
        gap_m: distance to the robot in front, in m, or None if this robot does not follow another
            robot.
    """

    time_s: float
    pose: Pose
    planned: Pose | None = None
    gap_m: float | None = None

    @property
    def gap(self) -> float:
        """The gap for a curve, with NaN (an interruption) in place of None."""
        return nan if self.gap_m is None else self.gap_m


@dataclass(slots=True)
class RobotTrack:
    """Recorded motion of one robot, which `draw` shows as a path and curves.

    Attributes:
        name: name of the robot in the legend.
        looks: samples of the robot, one sample every `LOOK_US`.
        corners: corners of the planned path, if the path is known before the run. Otherwise the
            planned path consists of the planned poses in `looks`.
    """

    name: str
    looks: list[RobotSample] = field(default_factory=list)
    corners: Sequence[Pose] = ()

    @property
    def planned(self) -> Sequence[Pose]:
        """The planned path, which a pose of NaN interrupts."""
        return self.corners or [look.planned or _NEVER for look in self.looks]

    def speeds(self) -> Iterator[tuple[float, float, float]]:
        """Yield time in s, speed in m/s and turning rate in rad/s between samples."""
        for before, now in pairwise(self.looks):
            step_s = now.time_s - before.time_s
            way_m = before.pose.distance(now.pose)
            backward = before.pose.along(now.pose) < -way_m / 2  # sideways counts as forward
            turn = wrap(now.pose.heading - before.pose.heading)
            yield now.time_s, (-way_m if backward else way_m) / step_s, turn / step_s


class Mark(NamedTuple):
    """A change during a run of the robots, which `draw` marks with a number in the picture.

    Attributes:
        time_s: time of the change since the start of the run, in s.
        text: description of the change, for the list below the picture.
    """

    time_s: float
    text: str


def advanced(pose: Pose, velocity: tuple[float, float, float], step_s: float) -> Pose:
    """Return the pose after a velocity command, for a robot that follows the command without delay.

    Args:
        pose: pose before the command.
        velocity: velocity forward and to the left in m/s, and turning rate in rad/s.
        step_s: time for which the robot moves with this velocity, in s.

    >>> advanced(Pose(), (0.5, 0.0, 0.0), 2.0)
    Pose(x=1.0, y=0.0, heading=0.0)
    """
    forward, left, turn = velocity
    middle = pose.heading + turn * step_s / 2
    return Pose(
        pose.x + (forward * cos(middle) - left * sin(middle)) * step_s,
        pose.y + (forward * sin(middle) + left * cos(middle)) * step_s,
        wrap(pose.heading + turn * step_s),
    )


# The picture: paths in the plane at the left, curves over time at the right (Fig. 99).


def draw(tracks: Sequence[RobotTrack], marks: Sequence[Mark], title: str) -> Figure:
    """Draw the paths of robots, and their speeds, turning rates and gaps over time.

    Args:
        tracks: recorded motions of the robots.
        marks: changes during the run, which are numbered in the picture and listed below it.
        title: title of the picture.

    Returns:
        The figure of matplotlib.
    """
    follows = any(look.gap_m is not None for track in tracks for look in track.looks)
    figure = new_figure(12, 7)
    figure.suptitle(title)
    grid = figure.add_gridspec(2 + follows, 2, width_ratios=(5, 4))
    ground = figure.add_subplot(grid[:, 0])
    curves = [figure.add_subplot(grid[row, 1]) for row in range(2 + follows)]
    for track, colour in zip(tracks, _COLOURS, strict=False):
        _draw_path(ground, track, marks, colour)
        times, speeds, turns = zip(*track.speeds(), strict=True)
        curves[0].plot(times, speeds, color=colour, label=track.name)
        curves[1].plot(times, turns, color=colour)
        if any(look.gap_m is not None for look in track.looks):
            gaps = [look.gap for look in track.looks]
            curves[2].plot([look.time_s for look in track.looks], gaps, color=colour)
    ground.plot([], [], "--", color="black", label="planned")
    ground.plot([], [], color="black", label="driven")
    ground.plot([], [], "o", color="black", label="start")
    ground.plot([], [], "s", color="black", label="end")
    ground.set_aspect("equal", adjustable="datalim")
    ground.set_xlabel("x, m")
    ground.set_ylabel("y, m")
    ground.legend(loc="best", fontsize="small")
    for axes in curves[:-1]:
        axes.sharex(curves[-1])
        axes.tick_params(labelbottom=False)
    for axes, label in zip(
        curves, ("speed, m/s", "turning, rad/s", "distance to the leader, m"), strict=False
    ):
        axes.set_ylabel(label)
    curves[-1].set_xlabel("time, s")
    for axes in (ground, *curves):
        axes.grid(visible=True, alpha=0.3)
    _draw_marks(curves, marks)
    if marks:
        lines = (f"({n}) {mark.time_s:.0f} s: {mark.text}" for n, mark in enumerate(marks, 1))
        figure.supxlabel("\n".join(lines), fontsize="small", x=0.02, ha="left")
    return figure


def _draw_path(ground: Axes, track: RobotTrack, marks: Sequence[Mark], colour: str) -> None:
    driven, planned = [look.pose for look in track.looks], track.planned
    ground.plot([p.x for p in driven], [p.y for p in driven], color=colour, label=track.name)
    ground.plot([p.x for p in planned], [p.y for p in planned], "--", color=colour, zorder=3)
    ground.plot(driven[0].x, driven[0].y, "o", color=colour)
    ground.plot(driven[-1].x, driven[-1].y, "s", color=colour)
    for number, mark in enumerate(marks, 1):
        there = next((look.pose for look in track.looks if look.time_s >= mark.time_s), driven[-1])
        ground.plot(there.x, there.y, ".", color=colour)
        ground.annotate(
            f"{number}", there[:2], xytext=(3, 3), textcoords="offset points", fontsize="small"
        )


def _draw_marks(curves: Sequence[Axes], marks: Sequence[Mark]) -> None:
    for number, mark in enumerate(marks, 1):
        for axes in curves:
            axes.axvline(mark.time_s, color="gray", linestyle=":", linewidth=1)
        curves[0].annotate(
            f"{number}",
            (mark.time_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            fontsize="small",
        )
