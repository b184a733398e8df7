"""The command `tickrig rtc`: run a system of RT components, and work with a running one."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.engine_options import openrtm_options, ros2_options
from tickrig.host.cli.options import PATH, NumberRange, works_in
from tickrig.host.rtc.commands.request import VARIABLE, default_path
from tickrig.host.rtc.commands.verbs import SYSTEM_VERBS, VERBS, conf


@click.group()
def rtc() -> None:
    """Run RT components, and work with them while they run.

    The commands are similar to those of rtshell, the command-line tools of OpenRTM. Components are
    named ConsoleIn0 or localhost/ConsoleIn0.rtc. Ports are named ConsoleIn0.out or
    localhost/ConsoleIn0.rtc:out.

    \b
    tickrig rtc run system.toml                      in one terminal
    tickrig rtc ls -l                                in another one
    tickrig rtc con ConsoleIn0.out ConsoleOut0.in
    tickrig rtc act ConsoleIn0 ConsoleOut0
    tickrig rtc print ConsoleIn0.out
    tickrig rtc inject ConsoleOut0.in 5
    tickrig rtc edit                                 all of it on the screen

    The exit status is 0 for success. It is 1 if a component did not reach the requested state, or
    if the command `check` found a difference. It is 2, with a message of one line, if a request was
    refused.
    """  # noqa: D301 - click wants the backspace


@rtc.command()
@click.argument("system", type=PATH, required=False)
@click.option(
    "--control",
    type=PATH,
    envvar=VARIABLE,
    default=default_path,
    metavar="PATH",
    help=f"Control socket to serve; also from {VARIABLE}.",
)
@click.option(
    "--component",
    "components",
    multiple=True,
    metavar="FILE.py:Class",
    help="Add a type of components; may be repeated.",
)
@click.option(
    "--lite",
    "lites",
    multiple=True,
    metavar="NAME=URL[@BAUD][,rtno][,boot=TIME]",
    help="Add a proxy NAME0 of a device of RTC-Lite, or of a board with RTno, at a pyserial URL;"
    " may be repeated.",
)
@click.option(
    "--lite-boot",
    default="0s",
    metavar="TIME",
    help="Pause after a line is opened, such as 3s.  [0s, rtno 3s]",
)
@click.option(
    "--rate", "rate_hz", type=NumberRange(1e-6, 1e6), metavar="HZ", help="Rate of all components."
)
@click.option("--save", type=PATH, help="Write the system to a .toml or .xml file at the end.")
@click.option(
    "--console", is_flag=True, help="Send typed lines to the components that accept them."
)
@openrtm_options
@ros2_options
@works_in("tickrig.host.rtc.commands.run:run_system")
def run(**options: Any) -> None:
    """Run the system of a file in real time, until Ctrl-C.

    SYSTEM is a .toml file of ours, or an RTSProfile .xml as rtcryo and RT System Editor write it.
    Without SYSTEM, there is no component at first. Values that arrive at a ConsoleOut are printed.

    Types: ConsoleIn, ConsoleOut, SeqIn, SeqOut, ConfigSample, RefHardRh3,
    Odometry, PositionInput, OmniTo2WD, Navigation, PathFollower and others; an
    unknown type is refused with a list of all.

    \b
    tickrig rtc run system.toml
    tickrig rtc run system.xml --component my_rtc.py:Scale --save after.toml
    seq 1 5 | tickrig rtc run chain.toml --console
    tickrig rtc run lite.toml --lite LiteA=/dev/ttyUSB0@57600 --lite LiteB=/tmp/lite-b
    tickrig rtc run board.toml --lite Board=/dev/ttyACM0,rtno,boot=2s
    tickrig rtc run system.toml --openrtm localhost:2809
    tickrig rtc run system.toml --ros2 --ros2-table topics.toml
    """  # noqa: D301 - click wants the backspace


for _command in (*VERBS, *SYSTEM_VERBS, conf):
    rtc.add_command(_command)
