"""`rh3 square`: UMBmark before and after a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import click

from tickrig.emulators.rh3.cart.options import MotionOptions, RunWatcher, watched
from tickrig.host.cli.options import NumberRange
from tickrig.host.cli.refused import refuse_path
from tickrig.host.rtc.motion.drive import BaseConnection, stop
from tickrig.host.rtc.motion.geometry import Pose, Wheels
from tickrig.host.rtc.motion.umbmark import Umbmark, run_umbmark, square
from tickrig.host.text.whole_file import write_whole


class SquarePlan(NamedTuple):
    """How many squares each way, and how large."""

    runs: int
    side_m: float

    @property
    def corners(self) -> list[Pose]:
        """All corners of both ways."""
        there, back = (square(clockwise=way, side_m=self.side_m) for way in (True, False))
        return [*there, *back]


class Squares:
    """Squares of one run of `rh3`, each with a cart at the origin.

    Args:
        options: the options.
        size: how many, and how large.
        watcher: receives each sample.

    Attributes:
        latest: the connection of the latest square.
    """

    def __init__(self, options: MotionOptions, size: SquarePlan, watcher: RunWatcher) -> None:
        self._options, self._size, self._watcher = options, size, watcher
        self.latest: BaseConnection | None = None

    def run(self, wheels: Wheels | None = None) -> Umbmark:
        """Drive squares; with other radii and axle if they are given."""
        try:
            return run_umbmark(
                lambda number: self._begin(wheels),
                self._true_pose,
                self._size.runs,
                self._size.side_m,
                self._watcher.watch,
            )
        except TimeoutError as error:
            error_reason = self.latest.chain.ref_hard.error_reason if self.latest else ""
            raise click.ClickException(error_reason or str(error)) from None

    def stop(self) -> None:
        """Stop the cart."""
        if self.latest is not None:
            stop(self.latest)

    def _begin(self, wheels: Wheels | None) -> BaseConnection:
        self.stop()
        if self._options.device is not None:
            with self._watcher.asking():
                click.pause("Put the cart at its start, and press a key.")
        self.latest = self._options.begin(wheels)
        return self.latest

    def _true_pose(self, connection: BaseConnection) -> Pose:
        if self._options.device is None:
            return connection.pose
        with self._watcher.asking():
            x_mm, y_mm = (
                click.prompt(f"Measured {axis} of the cart from its start, mm", type=NumberRange())
                for axis in ("x", "y")
            )
        return Pose(x_mm / 1e3, y_mm / 1e3)


def run_squares(options: MotionOptions, size: SquarePlan, save: Path | None) -> None:
    """Drive squares, calibrate, drive them again, and print how both went."""
    with watched(options, size.corners) as watcher:
        squares = Squares(options, size, watcher)
        try:
            before = squares.run()
            assert squares.latest is not None
            corrected = before.corrected(squares.latest.chain.odometry.wheels, size.side_m)
            after = squares.run(corrected)
        finally:
            squares.stop()
    click.echo("              before   after")
    _print_row("E_max,syst", before.most_m, after.most_m)
    _print_row("return, most", max(before.returns_m), max(after.returns_m))
    text = _conf(corrected)
    click.echo(text, nl=False)
    if save is not None:
        try:
            write_whole(save, text)
        except OSError as error:
            refuse_path("save", error)


def _print_row(what: str, before_m: float, after_m: float) -> None:
    click.echo(f"{what:<12} {before_m * 1e3:7.1f} {after_m * 1e3:7.1f} mm")


def _conf(wheels: Wheels) -> str:
    """Return an Odometry.conf."""
    return (
        f"conf.default.radiusOfLeftWheel: {wheels.left:.7f}\n"
        f"conf.default.radiusOfRightWheel: {wheels.right:.7f}\n"
        f"conf.default.lengthOfAxle: {wheels.axle:.7f}\n"
    )
