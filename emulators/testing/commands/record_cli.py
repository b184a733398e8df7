"""The command `tickrig record`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.emulators.commands.run_options import type_option
from tickrig.host.cli.options import PATH, works_in


@click.command("record")
@click.argument("port")
@click.option(
    "-o", "--out", type=PATH, required=True, metavar="FILE", help="Write the trace to FILE."
)
@type_option("Device type, as for 'tickrig emu', such as rrc.")
@click.option("--link", type=PATH, help="Make a symbolic link to the host's terminal.")
@click.option(
    "--baud",
    type=click.IntRange(1),
    help="Bit rate of the line in bit/s. [that of the type, or 115200]",
)
@works_in("tickrig.emulators.testing.commands.port_tap:record_port")
def record_command(**options: Any) -> None:
    """Record the traffic between a host and the device at PORT, for `tickrig compare`.

    PORT is a device path or a URL of pyserial. The command makes a terminal, and prints the path of
    the terminal. The host opens this terminal instead of PORT. The option --link makes a symbolic
    link to the terminal. Bytes pass unchanged and at once. Ctrl-C ends the recording.

    Type manual actions on the device here to record them: NAME=VALUE for an input, such as
    power_button=1, or reset if you switch the device off and on.

    The exit status is 3 if the port is lost, or the recording is incomplete.

    \b
    tickrig record /dev/ttyUSB0 --out run.trace --type rrc --link /tmp/rrc
    tickrig compare run.trace
    """  # noqa: D301 - click wants the backspace
