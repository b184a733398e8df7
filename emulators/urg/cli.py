"""The command `urg-emu`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.emulators.commands.run_options import (
    SERIAL_FAULTS,
    device_options,
    line_options,
    run_named,
)
from tickrig.emulators.urg.fields import FIELDS
from tickrig.host.cli.options import HarmlessCommand


@click.command(cls=HarmlessCommand)
@device_options(FIELDS)
@line_options(SERIAL_FAULTS, "tickrig.device.urg.sensor:INPUTS")
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
