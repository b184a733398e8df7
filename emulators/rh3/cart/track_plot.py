"""A run as a picture: path, cross-track error and velocities; needs the extra `plot`."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

from tickrig.emulators.commands.picture import new_figure, write_figure
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.motion_run import MotionRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def write_track(run: MotionRun, points: Sequence[Pose], title: str, path: Path) -> None:
    """Draw a run into a file, PNG, SVG or HTML by its name.

    Raises:
        OSError: the file cannot be written.
    """
    write_figure(_draw(run, points, title), title, path)


def _draw(run: MotionRun, points: Sequence[Pose], title: str) -> Figure:
    figure = new_figure(9, 9)
    figure.suptitle(title)
    ground, beside, speed, turn = figure.subplots(4, 1, height_ratios=(4, 1, 1, 1))
    samples, times = run.samples, [sample.time_s for sample in run.samples]
    _draw_ground(ground, run, points)
    beside.plot(times, [_beside_mm(s.line, s.pose) for s in samples], color="tab:red")
    beside.set_ylabel("off line, mm")
    speed.plot(times, [sample.twist.v for sample in samples], color="tab:blue")
    speed.set_ylabel("forward, m/s")
    turn.plot(times, [sample.twist.w for sample in samples], color="tab:orange")
    turn.set_ylabel("turning, rad/s")
    turn.set_xlabel("time, s")
    beside.sharex(turn)
    speed.sharex(turn)
    for axes in (ground, beside, speed, turn):
        axes.grid(visible=True, alpha=0.3)
    return figure


def _draw_ground(axes: Axes, run: MotionRun, points: Sequence[Pose]) -> None:
    track = [sample.pose for sample in run.samples]
    axes.plot([p.x for p in points], [p.y for p in points], "+", color="tab:gray", label="points")
    axes.plot([p.x for p in track], [p.y for p in track], color="tab:blue", label="track")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.legend(loc="best")


def _beside_mm(line: Pose | None, pose: Pose) -> float:
    return nan if line is None else line.left(pose) * 1e3
