"""The command `rrc-emu`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.emulators.commands.run_options import (
    SERIAL_FAULTS,
    device_options,
    line_options,
    run_named,
)
from tickrig.emulators.rrc.fields import FIELDS
from tickrig.host.cli.options import HarmlessCommand


@click.command(cls=HarmlessCommand)
@device_options(FIELDS)
@click.option("--panel", is_flag=True, help="Show an operator panel in this terminal.")
@line_options(SERIAL_FAULTS, "tickrig.device.rrc.board:INPUTS")
@click.pass_context
def main(context: click.Context, /, **options: Any) -> None:
    """Emulate an RRC, with the VR2 wheelchair around it, on a pseudo-terminal.

    It runs in real time until Ctrl-C. A scenario alone runs in virtual time:
    as fast as it goes, with the same transcript each time, exit status 1 if
    something expected did not come. Together with --link, --serve or
    --control it is played in real time.

    \b
    rrc-emu --link /tmp/rrc --control /tmp/rrc.ctl
    tickrig ctl /tmp/rrc.ctl press power_button
    rrc-emu --serve rfc2217://7000
    rrc-emu --scenario drive.txt
    echo '1s press power_button' | rrc-emu --link /tmp/rrc --scenario -
    rrc-emu --link /tmp/rrc --fault flip=0.001 --fault cut@5s-7s -v
    """  # noqa: D301 - click wants the backspace
    context.exit(run_named("rrc", options))
