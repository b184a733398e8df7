"""The command `ucode-reader-emu`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.emulators.commands.run_options import line_options, run_named
from tickrig.host.cli.options import HarmlessCommand, NumberRange


@click.command(cls=HarmlessCommand)
@click.option(
    "--marker", "markers", multiple=True, metavar="UCODE,X,Y", help="A marker, place in m."
)
@click.option(
    "--range",
    "range_m",
    type=NumberRange(0.1, 99),
    default=3.0,
    metavar="M",
    help="How far it hears a marker.  [3]",
)
@click.option(
    "--cone",
    "cone_deg",
    type=click.IntRange(1, 360),
    default=90,
    metavar="DEG",
    help="Whole angle in which it hears, around where it looks.  [90]",
)
@line_options("flip, drop, dup, cut", "tickrig.device.ucode_reader:INPUTS")
@click.pass_context
def main(context: click.Context, /, **options: Any) -> None:
    """Emulate an infra-red reader of ucodes on a pseudo-terminal (38400 8N1).

    Markers in the environment send ucodes of 128 bits, written as 32 hex
    digits; the reader tells each 100 ms which it hears, in lines of ASCII.
    It runs in real time until Ctrl-C. A scenario alone runs in virtual time:
    as fast as it goes, with the same transcript each time, exit status 1 if
    something expected did not come. Together with --link, --serve or
    --control it is played in real time.

    \b
    ucode-reader-emu --link /tmp/ucode --control /tmp/ucode.ctl \\
        --marker 00001C00000000000001000000000001,1,0
    tickrig ctl /tmp/ucode.ctl set pose 0.5 0 1.57
    tickrig ctl /tmp/ucode.ctl fault sunlight
    printf '250ms send ID\\n250ms expect $UI* within 10ms' | ucode-reader-emu --scenario -

    \b
    Completion of options in the shell:
    eval "$(_UCODE_READER_EMU_COMPLETE=bash_source ucode-reader-emu)"
    """  # noqa: D301 - click wants the backspace
    context.exit(run_named("ucode-reader", options))
