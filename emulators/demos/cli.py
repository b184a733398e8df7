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
        help="Control socket to serve, for 'tickrig rtc --at PATH'; the run is in real time until"
        " Ctrl-C.",
    ),
    openrtm_options,
)


@click.command()
@works_in("tickrig.emulators.demos.terminal_cli:show_rrc")
def rrc() -> None:
    """Drive an emulated RRC, the controller of a wheelchair, on a pty.

    The demonstration shows power-on, the sample commands of the RRC's manual, output mode and a
    watchdog trip.

    \b
    tickrig demo rrc
    """  # noqa: D301 - click wants the backspace


@click.command("rtc-lite")
@click.option(
    "--virtual", is_flag=True, help="Run in virtual time: at once, with the same lines each time."
)
@works_in("tickrig.emulators.demos.terminal_cli:show_rtc_lite")
def rtc_lite(virtual: bool) -> None:
    """Send numbers through two emulated PICs, cut the power of one, and see it come back.

    The demonstration repeats the experiments of the paper on RTComponent-Lite. The component
    ConsoleIn sends numbers through LiteA and LiteB, which run on the PICs, to ConsoleOut. The
    devices are processes on two ptys, in real time.

    \b
    tickrig demo rtc-lite
    tickrig demo rtc-lite --virtual
    """  # noqa: D301 - click wants the backspace


@click.command()
@click.option(
    "--no-caches", is_flag=True, help="Let the entries of the caches expire during the outage."
)
@works_in("tickrig.emulators.demos.terminal_cli:show_tkernel")
def tkernel(no_caches: bool) -> None:
    """Let a robot find its position by infra-red markers while a service is unreachable.

    A cart of Reference Hardware 3 with worn wheels drives along a corridor with infra-red markers.
    Each marker sends a ucode, a number that identifies the marker. A node on T-Kernel reads the
    ucodes. The resolution service gives the place of each ucode. On the way back the service is
    unreachable, and the node takes the places from its caches. The run is in virtual time and
    prints the same lines each time.

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

    The node with the potentiometer is an f-palette, an I/O board. The node with the motor is a
    motor core unit. A CANopen master links the analogue input of the f-palette with the reference
    value of the motor core unit (PDO linking). Then the master starts both nodes, and leaves the
    bus. The demonstration runs in virtual time. With -i and -c it runs in real time on a bus of
    python-can.

    \b
    tickrig demo fig120
    tickrig demo fig120 --plot curves.png
    tickrig demo fig120 -i socketcan -c vcan0
    """  # noqa: D301 - click wants the backspace


@click.command()
@_LIVE
@works_in("tickrig.emulators.demos.terminal_cli:show_follow")
def follow(**options: Any) -> None:
    """Let two robots follow a preceding one (NEDO report, experiment A, Fig. 96).

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
    """Exchange the leaders of two pairs of robots, then remove a connection and join it again.

    This is experiment B1 of the NEDO report (Figs. 98 and 99). Two joysticks drive the robots
    Omni-Wheel and Segway RMP. The robots Ref-Hard and BlackShip follow these two. The leaders are
    exchanged twice. Then the connection of Ref-Hard is removed, and joined again. The run is in
    virtual time and prints the same lines each time. With --control or --openrtm it runs in real
    time, and other programs can change the connections.

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
    """Drive four robots with one joystick, then two of them with another joystick.

    This is experiment B2 of the NEDO report (Figs. 91 and 101). It begins with the connections at
    the end of experiment B1, which 'tickrig demo leader' shows. All connections that command a
    robot are removed, and the robots stop. Then one joystick is connected to all four robots. Later
    the other joystick is connected to two of the robots instead. The run is in virtual time and
    prints the same lines each time. With --control or --openrtm it runs in real time, and other
    programs can change the connections.

    \b
    tickrig demo four --plot four.png
    tickrig demo four --openrtm localhost:2809
    """  # noqa: D301 - click wants the backspace


@click.command()
@_LIVE
@works_in("tickrig.emulators.demos.terminal_cli:show_joystick")
def joystick(**options: Any) -> None:
    """Drive two robots of different make with one joystick (NEDO report, Fig. 92).

    The joystick writes velocities to the robot Ref-Hard, which has two wheels, and to the robot
    Omni-Wheel, which has omni wheels. The ports have the type RTC::TimedVelocity, which belongs to
    phase 1 of the common interfaces of the report. The run is in virtual time and prints the same
    lines each time. With --control or --openrtm it runs in real time, and other programs can change
    the connections.

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

    The component PositionInput sends a goal. Then PositionInput sends a square as the path. The
    cart stands on rough ground. The run is in virtual time and prints the same lines each time.

    \b
    tickrig demo rh3
    tickrig demo rh3 --plot rh3.png
    """  # noqa: D301 - click wants the backspace


@click.command()
@_PLOT
@works_in("tickrig.emulators.demos.terminal_cli:show_beego")
def beego(plot: Path | None) -> None:
    """Drive beego, two CANopen drives at its wheels, with a joystick.

    The two drives are emulated EPOS. The server of RTC-CANopen starts a proxy, an RT component, for
    each drive. A joystick drives straight on, along an arc and on the spot. The run is in virtual
    time and prints the same lines each time.

    \b
    tickrig demo beego
    tickrig demo beego --plot beego.png
    """  # noqa: D301 - click wants the backspace


@click.command()
@_PLOT
@works_in("tickrig.emulators.demos.terminal_cli:show_fourx")
def fourx(plot: Path | None) -> None:
    """Drive FourX, four motor core units at its wheels, with a joystick.

    The motor core units are emulated. The server of RTC-CANopen starts a proxy, an RT component,
    for each unit. A joystick drives straight on, along an arc and on the spot. The run is in
    virtual time and prints the same lines each time.

    \b
    tickrig demo fourx
    tickrig demo fourx --plot fourx.png
    """  # noqa: D301 - click wants the backspace
