"""What `rh3` does: runs of the options of its command line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from tickrig.emulators.commands.picture import check_plot
from tickrig.emulators.rh3.base_options import NAMES, read_parameters
from tickrig.emulators.rh3.cart.options import (
    MotionOptions,
    require_arrival,
    watched,
)
from tickrig.emulators.rh3.cart.served_cart import serve_cart
from tickrig.emulators.rh3.cart.squares import SquarePlan, run_squares
from tickrig.emulators.rh3.cart.topics import SCAN, TOPICS
from tickrig.emulators.rh3.cart.track_plot import write_track
from tickrig.host.cli.engine_options import take_engines
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.rtc.motion.drive import drive, stop
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.path_file import FARTHEST_M, read_path, within_reach
from tickrig.host.rtc.motion.ports import plausible
from tickrig.host.rtc.motion.run_report import limits_of, table
from tickrig.host.rtc.motion.umbmark import SIDE_M


def go_to(x: float, y: float, theta: float, options: dict[str, Any]) -> None:
    """Drive to a pose, in metres and radians."""
    if not plausible(x, y, theta):
        raise Refused(f"{x:g} {y:g} {theta:g} is no pose: metres, metres, radians")
    if not within_reach(goal := Pose(x, y, theta)):
        raise Refused(f"{x:g} {y:g} {theta:g} is beyond {FARTHEST_M} m")
    _drive(_checked(options), [goal], f"rh3 goto {x:g} {y:g} {theta:g}")


def go_along(file: Path, options: dict[str, Any]) -> None:
    """Drive along the points of a file."""
    try:
        points = read_path(file)
    except ValueError as error:
        raise Refused(str(error)) from None
    _drive(_checked(options), points, f"rh3 path {file.name}")


def go_round(
    runs: int | None, side_m: float | None, save: Path | None, options: dict[str, Any]
) -> None:
    """Drive squares both ways, `runs` times or as often as is of use."""
    checked = _checked(options)
    by_chance = checked.device is not None or checked.base.noise
    run_squares(checked, SquarePlan(runs or (5 if by_chance else 1), side_m or SIDE_M), save)


def serve(options: dict[str, Any]) -> None:
    """Run a cart in real time until Ctrl-C."""
    room_m = options["room_m"]
    if room_m and options["device"]:
        raise Refused("--room is for the emulated base; a --device has what is around it")
    engines = take_engines(options, TOPICS + SCAN if room_m else TOPICS)
    if engines.ros2 and options["pace"] not in {None, 1.0}:
        raise Refused("--pace is not for --ros2: what others send has real time")
    pace = options["pace"] or (None if options["device"] else 1.0)
    control = options.pop("control")
    serve_cart(_checked({**options, "pace": pace}), engines, control)


def _checked(options: dict[str, Any]) -> MotionOptions:
    given = {name: options.pop(name) for name in (*NAMES, "seed")}
    if options["device"] is not None and options["pace"] is not None:
        raise Refused("--pace is for the emulated base; a --device has real time")
    if options["any_device"] and options["device"] is None:
        raise Refused("--any-device is for a --device; the emulated base is known")
    if options["show_map"] is None:
        options["show_map"] = sys.stdout.isatty()
    checked = MotionOptions(**options, base=read_parameters(given))
    if checked.plot is not None:
        check_plot(checked.plot)  # before the run, not after it
    return checked


def _drive(options: MotionOptions, points: Sequence[Pose], title: str) -> None:
    connection = options.begin()
    began = connection.chain.odometry.pose
    with watched(options, [began, *points]) as watcher:
        try:
            run = drive(connection, points, watcher.watch)
            require_arrival(connection, run)
        finally:
            stop(connection)
    for line in table(run, began, points, limits_of(connection.chain)):
        click.echo(line)
    if options.plot is not None:
        try:
            write_track(run, points, title, options.plot)
        except OSError as error:
            refuse_path("plot", error)
