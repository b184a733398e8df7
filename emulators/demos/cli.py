"""The commands of `tickrig demo`; each command has a separate module for its work."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.can_options import BusCommand, bus_options
from tickrig.host.cli.engine_options import openrtm_options
from tickrig.host.cli.options import PATH, Decorator, add_options, works_in

_PLOT: Final = click.option(
    "--plot", type=PATH, help="Draw paths and speeds into FILE.png, .svg or .html."
)
_LIVE: Final[Decorator] = add_options(
    _PLOT,
    click.option(
        "--control",
        type=PATH,
        help="Control socket for tickrig rtc con and dis --at PATH; in real time until Ctrl-C.",
    ),
    openrtm_options,
)


@click.command()
@works_in("tickrig.emulators.demos.terminal_cli:show_rrc")
def rrc() -> None:
    """Drive an RRC on a pty through power-on, all samples, output mode and a watchdog trip.

    \b
    tickrig demo rrc
    """  # noqa: D301 - click wants the backspace


@click.command("rtc-lite")
@click.option("--virtual", is_flag=True, help="In virtual time: the same lines each time, at once.")
@works_in("tickrig.emulators.demos.terminal_cli:show_rtc_lite")
def rtc_lite(virtual: bool) -> None:
    """Send numbers through two emulated PICs, cut the power of one, and see it come back.

    ConsoleIn, LiteA, LiteB, ConsoleOut: the experiments of the paper on
    RTComponent-Lite. The devices are processes on two ptys, in real time.

    \b
    tickrig demo rtc-lite
    tickrig demo rtc-lite --virtual
    """  # noqa: D301 - click wants the backspace


@click.command()
@click.option("--no-caches", is_flag=True, help="Entries of the caches do not outlive the outage.")
@works_in("tickrig.emulators.demos.terminal_cli:show_tkernel")
def tkernel(no_caches: bool) -> None:
    """Let a robot keep its position by ucodes while the service that resolves them is gone.

    A cart of Reference Hardware 3 with worn wheels drives along a corridor with infra-red markers;
    a node on T-Kernel reads their ucodes. On the way back the resolution service is unreachable,
    and the caches of the node replace it. The run is in virtual time and prints the same lines each
    time.

    \b
    tickrig demo tkernel
    tickrig demo tkernel --no-caches
    """  # noqa: D301 - click wants the backspace


@click.command(cls=BusCommand)
@click.option("--plot", type=PATH, help="Draw the curves into FILE.png, .svg or .html.")
@bus_options
@works_in("tickrig.emulators.demos.terminal_cli:show_fig120")
def fig120(plot: Path | None, **options: Any) -> None:
    """Let a potentiometer at one CANopen node turn the motor of another, without a PC in between.

    A master links the analogue input of an f-palette with the reference of a
    motor core unit (PDO linking), starts both and leaves the bus. It runs in
    virtual time; with -i and -c in real time on a bus of python-can.

    \b
    tickrig demo fig120
    tickrig demo fig120 --plot curves.png
    tickrig demo fig120 -i socketcan -c vcan0
    """  # noqa: D301 - click wants the backspace


@click.command()
@_LIVE
@works_in("tickrig.emulators.demos.terminal_cli:show_follow")
def follow(**options: Any) -> None:
    """Let two robots follow a preceding one (experiment A, Fig. 96).

    A joystick drives Ref-Hard, Segway RMP follows Ref-Hard by its position, and Omni-Wheel follows
    Segway RMP. The run is in virtual time and prints the same lines each time. With --control or
    --openrtm it runs in real time, and other programs can change the connections.

    \b
    tickrig demo follow --plot follow.png
    tickrig demo follow --control /tmp/convoy
    tickrig rtc dis Odometry1.OdometryPosition Follower2.leader --at /tmp/convoy
    tickrig rtc con Odometry0.OdometryPosition Follower2.leader --at /tmp/convoy
    """  # noqa: D301 - click wants the backspace


@click.command()
@_LIVE
@works_in("tickrig.emulators.demos.terminal_cli:show_leader")
def leader(**options: Any) -> None:
    """Exchange leaders of two pairs of robots, remove a connection and join it again (B1).

    Two joysticks drive Omni-Wheel and Segway RMP; Ref-Hard and BlackShip follow them. The leaders
    are exchanged twice, then Ref-Hard's connection is removed, and joined again (Figs. 98 and 99).
    The run is in virtual time and prints the same lines each time. With --control or --openrtm it
    runs in real time, and other programs can change the connections.

    \b
    tickrig demo leader --plot leader.png
    tickrig demo leader --control /tmp/convoy --plot leader.png
    tickrig rtc dis OmniCart0.OdometryPosition Follower0.leader --at /tmp/convoy
    tickrig rtc con Odometry1.OdometryPosition Follower0.leader --at /tmp/convoy
    """  # noqa: D301 - click wants the backspace


@click.command()
@_LIVE
@works_in("tickrig.emulators.demos.terminal_cli:show_four")
def four(**options: Any) -> None:
    """Drive four robots with one joystick, then each with any (B2, Figs. 91 and 101).

    The experiment begins with the connections at the end of B1. All connections that command a
    robot are removed, and the robots stop. Then one joystick is connected to all four, and later
    two of them are given to the other joystick. The run is in virtual time and prints the same
    lines each time. With --control or --openrtm it runs in real time, and other programs can change
    the connections.

    \b
    tickrig demo four --plot four.png
    tickrig demo four --openrtm localhost:2809
    """  # noqa: D301 - click wants the backspace


@click.command()
@_LIVE
@works_in("tickrig.emulators.demos.terminal_cli:show_joystick")
def joystick(**options: Any) -> None:
    """Drive two robots of different make with one joystick (Fig. 92).

    The joystick writes RTC::TimedVelocity of phase 1 to Ref-Hard on two wheels and to Omni-Wheel.
    The run is in virtual time and prints the same lines each time. With --control or --openrtm it
    runs in real time, and other programs can change the connections.

    \b
    tickrig demo joystick --plot joystick.png
    tickrig demo joystick --control /tmp/robots
    tickrig rtc dis JoystickA.out MovingControl1.in --at /tmp/robots
    """  # noqa: D301 - click wants the backspace


@click.command()
@_PLOT
@works_in("tickrig.emulators.demos.terminal_cli:show_rh3")
def rh3(plot: Path | None) -> None:
    """Let a cart of Reference Hardware 3 drive to a goal, and along a path.

    PositionInput sends a goal, then the square that it has as its path; the cart stands on rough
    ground. The run is in virtual time and prints the same lines each time.

    \b
    tickrig demo rh3
    tickrig demo rh3 --plot rh3.png
    """  # noqa: D301 - click wants the backspace


@click.command()
@_PLOT
@works_in("tickrig.emulators.demos.terminal_cli:show_beego")
def beego(plot: Path | None) -> None:
    """Drive beego, two CANopen drives at its wheels, with a joystick.

    The server of RTC-CANopen starts two emulated EPOS as proxies; a joystick drives straight on,
    along an arc and on the spot. The run is in virtual time and prints the same lines each time.

    \b
    tickrig demo beego
    tickrig demo beego --plot beego.png
    """  # noqa: D301 - click wants the backspace


@click.command()
@_PLOT
@works_in("tickrig.emulators.demos.terminal_cli:show_fourx")
def fourx(plot: Path | None) -> None:
    """Drive FourX, four motor core units at its wheels, with a joystick.

    The server of RTC-CANopen starts four emulated motor core units as proxies; a joystick drives
    straight on, along an arc and on the spot. The run is in virtual time and prints the same lines
    each time.

    \b
    tickrig demo fourx
    tickrig demo fourx --plot fourx.png
    """  # noqa: D301 - click wants the backspace
