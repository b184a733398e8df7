"""The command `urg-emu`."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.emulators.commands.run_options import line_options, run_named
from tickrig.host.cli.options import HarmlessCommand, NumberRange, add_options

USB_BAUD: Final = 12_000_000
"""As fast as USB at full speed."""

_WORLD: Final = add_options(
    click.option("--room", "size", metavar="WIDTH,DEPTH", help="Four walls around the origin, m."),
    click.option("--wall", "walls", multiple=True, metavar="X1,Y1,X2,Y2", help="A wall, m."),
    click.option("--post", "posts", multiple=True, metavar="X,Y,RADIUS", help="A round post, m."),
)


@click.command(cls=HarmlessCommand)
@click.option("--serial", default="H0614967", metavar="TEXT", help="Serial number.  [H0614967]")
@click.option(
    "--noise",
    type=NumberRange(0, 1),
    default=0.0,
    help="Share of the sensor's accuracy of 10 mm and 1 %.  [0]",
)
@click.option(
    "--scip",
    type=click.Choice(["1.1", "2.0"]),
    default="1.1",
    help="Protocol after power-up: 1.1 as the URG-04LX, 2.0 as the URG-04LX-UG01.  [1.1]",
)
@click.option(
    "--baud",
    type=click.IntRange(1_200, USB_BAUD),
    default=USB_BAUD,
    help="Bit rate of the line; a whole scan at 10 Hz needs 230400.  [12000000, as USB]",
)
@_WORLD
@line_options("flip, drop, dup, cut", "tickrig.device.urg.sensor:INPUTS")
@click.pass_context
def main(context: click.Context, /, **options: Any) -> None:
    """Emulate a scanning range finder URG-04LX (SCIP 1.1 and 2.0) on a pseudo-terminal.

    It runs in real time until Ctrl-C. A scenario alone runs in virtual time:
    as fast as it goes, with the same transcript each time, exit status 1 if
    something expected did not come. Together with --link, --serve or
    --control it is played in real time.

    \b
    urg-emu --link /tmp/urg --control /tmp/urg.ctl --room 4,3 --post 1,0.5,0.1
    tickrig ctl /tmp/urg.ctl set pose 0.5 0 1.57
    tickrig ctl /tmp/urg.ctl set post 1 0 0.2
    printf '0 send SCIP2.0\\n1ms send VV\\n1ms expect 00P within 10ms' | urg-emu --scenario -

    \b
    Completion of options in the shell:
    eval "$(_URG_EMU_COMPLETE=bash_source urg-emu)"
    """  # noqa: D301 - click wants the backspace
    context.exit(run_named("urg", options))
