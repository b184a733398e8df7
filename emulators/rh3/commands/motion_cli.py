"""The command `rh3`: drive a cart of Reference Hardware 3."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.commands.run_options import device_options
from tickrig.emulators.rh3.fields import PARAMETERS
from tickrig.host.cli.engine_options import openrtm_options, ros2_options
from tickrig.host.cli.options import (
    PATH,
    Choice,
    Decorator,
    LazyGroup,
    NumberRange,
    add_options,
    version_option,
    works_in,
)

_WORK: Final = "tickrig.emulators.rh3.commands.motion_verbs"

_COORDINATES: Final = {"ignore_unknown_options": True}
"""Settings with which `-1` is a number, not an option."""

_SHARED: Final[Decorator] = add_options(
    click.option(
        "--set",
        "set_id",
        type=Choice(["default", "tuned"]),
        default="default",
        show_default=True,
        help="Configuration set: default (values of the specification) or tuned (more precise).",
    ),
    click.option("--device", metavar="URL", help="Serial port of a base.  [an emulated base]"),
    click.option(
        "--any-device",
        is_flag=True,
        help="Drive the device without checking that it is an RH3 base.",
    ),
    click.option(
        "--baud",
        type=click.IntRange(1_200, 4_000_000),
        default=115_200,
        show_default=True,
        help="Bit rate of the device in bit/s, 8N1.",
    ),
    click.option(
        "--pace",
        type=NumberRange(0.01, 1_000),
        metavar="X",
        help="Speed of virtual time; 1 is real time.  [as fast as possible]",
    ),
    click.option(
        "--odometry-conf", "conf", type=PATH, help="File with lines conf.default.NAME: VALUE."
    ),
    click.option("--map/--no-map", "show_map", default=None, help="Draw the track during the run."),
    device_options(PARAMETERS),
    click.option("--seed", type=int, default=0, help="Seed of the noise.  [0]"),
)


_PLOT: Final[Decorator] = click.option(
    "--plot", type=PATH, help="Draw the journey into FILE.png, .svg or .html."
)


@click.group(cls=LazyGroup, commands={})
@version_option()
def main() -> None:
    """Drive a cart of Reference Hardware 3 with the six components of its motion chain.

    The base of the cart is emulated in virtual time. With --device the base is real hardware or
    rh3-emu, in real time. Ctrl-C stops the cart.

    \b
    rh3 goto 1 0.5 1.57 --set tuned --plot track.svg
    rh3 path corners.txt --pace 10
    rh3 square --tread-m 0.459
    rh3 goto 1 0 0 --device /dev/ttyUSB0
    rh3 serve --openrtm localhost:2809
    rh3 serve --ros2
    """  # noqa: D301 - click wants the backspace


@main.command(context_settings=_COORDINATES)
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("theta", type=float)
@_PLOT
@_SHARED
@works_in(f"{_WORK}:go_to")
def goto(x: float, y: float, theta: float, **options: Any) -> None:
    """Drive to X and Y in metres, and turn to THETA in radians.

    \b
    rh3 goto 1 0.5 1.57
    rh3 goto -1 0 0 --set tuned
    """  # noqa: D301


@main.command("path")
@click.argument("file", type=PATH)
@_PLOT
@_SHARED
@works_in(f"{_WORK}:go_along")
def _along_path(file: Path, **options: Any) -> None:
    """Drive along the points of FILE, whose lines have x, y in metres, and a heading in radians.

    Only the heading of the last point counts.

    \b
    printf '2 0\\n2 2\\n0 2\\n0 0 0\\n' > corners.txt
    rh3 path corners.txt
    """  # noqa: D301


@main.command()
@click.option(
    "--runs",
    type=click.IntRange(1, 100),
    help="Squares in each direction. [1; 5 with noise or --device]",
)
@click.option("--side", type=NumberRange(0.2, 100), metavar="M", help="Side of the squares.  [4]")
@click.option("--save", type=PATH, help="Write the corrected Odometry.conf to a file.")
@_SHARED
@works_in(f"{_WORK}:go_round")
def square(runs: int | None, side: float | None, save: Path | None, **options: Any) -> None:
    """Drive squares in both directions (UMBmark), and calibrate the odometry by them.

    After each square the true position of the cart is measured. For an emulated base the position
    is known. With --device you enter the position.

    \b
    rh3 square --tread-m 0.459 --save Odometry.conf
    rh3 square --tread-m 0.459 --odometry-conf Odometry.conf
    """  # noqa: D301


@main.command()
@openrtm_options
@ros2_options
@click.option(
    "--room",
    "room_m",
    nargs=2,
    type=NumberRange(0.1, 1_000),
    metavar="WIDTH DEPTH",
    help="Put walls around the emulated base, in m, and a range finder on the base.",
)
@click.option(
    "--control",
    type=PATH,
    help="Control socket to serve, for 'tickrig ctl PATH goal' and 'tickrig rtc --at PATH'.",
)
@_SHARED
@works_in(f"{_WORK}:serve")
def serve(**options: Any) -> None:
    """Run the six components of the cart in real time until Ctrl-C, for you and other programs.

    Type commands for the component PositionInput, one per line:

    \b
    goal X Y DEG         drive to X and Y, and turn to DEG
    path FILE            drive along the points of FILE
    path X Y, X Y DEG    drive along these points, two or more
    path                 drive a square of 1 m
    end                  put PositionInput into the state Error after the last command

    The units are metres and degrees, but radians in FILE.

    \b
    printf 'goal 1 0 90\\npath 0 0, 1 1\\n' | rh3 serve
    rh3 serve --control /tmp/cart
    rh3 serve --openrtm localhost:2809 --device /dev/ttyUSB0
    rh3 serve --ros2 --room 6 4
    """  # noqa: D301
