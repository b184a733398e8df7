"""The command `tickrig compare`."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.emulators.commands.run_options import type_option
from tickrig.host.cli.options import PATH, add_options, run_code_option, time_option, works_in

_device: Final = add_options(
    type_option("Device type, if the trace has none."),
    click.option(
        "--config",
        multiple=True,
        metavar="NAME=VALUE",
        help="Option of the device type, such as node=lite-a.",
    ),
    click.option(
        "--node",
        "nodes",
        multiple=True,
        metavar="ID=DEVICE",
        help="Node on a bus, such as 5=epos or 5=drive.eds.",
    ),
    time_option(
        "--settle", "settle_us", default="1s", help="Time from power-on to the recording. [1s]"
    ),
)
_tolerance: Final = add_options(
    time_option("--tolerance", "time_us", default="20ms", help="Tolerance of times. [20ms]"),
    click.option(
        "--number",
        "numbers",
        multiple=True,
        metavar="PATTERN=MOST",
        help="Largest difference of numbers in lines, such as 'EV:batt*=5' or '181#*[2:4]=1%'.",
    ),
    click.option(
        "--ignore", multiple=True, metavar="PATTERN", help="Ignore lines that match PATTERN."
    ),
    click.option(
        "--kind",
        "kinds",
        multiple=True,
        metavar="PATTERN",
        help="Compare the order of lines that match PATTERN separately.",
    ),
)


@click.command("compare")
@click.argument("file", type=PATH)
@_device
@_tolerance
@run_code_option
@click.option("-v", "--verbose", is_flag=True, help="List all lines, not only different ones.")
@works_in("tickrig.emulators.testing.commands.compare:run_compare")
def compare_command(**options: Any) -> None:
    """Replay a recorded host against an emulator; report differences from the recording.

    FILE is a trace of 'tickrig record', of an emulator or of a bench. The exit status is 0 if the
    emulator gives the same answers, 1 if not, and 2 if the runs cannot be compared.

    \b
    tickrig record /dev/ttyUSB0 --out run.trace --type rrc --link /tmp/rrc
    tickrig compare run.trace
    tickrig compare run.trace --tolerance 50ms --ignore 'Version*' --number 'EV:batt*=5'
    """  # noqa: D301 - click wants the backspace
