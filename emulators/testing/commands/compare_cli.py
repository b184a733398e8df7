"""The command `tickrig compare`."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.emulators.commands.run_options import type_option
from tickrig.host.cli.options import PATH, add_options, run_code_option, time_option, works_in

_device: Final = add_options(
    type_option("Device type, if the trace has none."),
    click.option(
        "--config", multiple=True, metavar="NAME=VALUE", help="An option of that type: node=lite-a."
    ),
    click.option(
        "--node", "nodes", multiple=True, metavar="ID=DEVICE", help="On a bus: 5=epos, 5=drive.eds."
    ),
    time_option("--settle", "settle_us", default="1s", help="On for so long before it.  [1s]"),
)
_tolerance: Final = add_options(
    time_option("--tolerance", "time_us", default="20ms", help="Of each time.  [20ms]"),
    click.option(
        "--number",
        "numbers",
        multiple=True,
        metavar="PATTERN=MOST",
        help="Numbers in such lines may differ: 'EV:batt*=5', '181#*[2:4]=1%'.",
    ),
    click.option("--ignore", multiple=True, metavar="PATTERN", help="Lines not compared."),
    click.option(
        "--kind",
        "kinds",
        multiple=True,
        metavar="PATTERN",
        help="Lines in an order of their own.",
    ),
)


@click.command("compare")
@click.argument("file", type=PATH)
@_device
@_tolerance
@run_code_option
@click.option("-v", "--verbose", is_flag=True, help="All that was said, the same too.")
@works_in("tickrig.emulators.testing.commands.compare:run_compare")
def compare_command(**options: Any) -> None:
    """Let the host of a recorded run talk to an emulator; say where it answers otherwise.

    FILE is a trace of 'tickrig record', of an emulator or of a bench. Exit status 0 if the
    emulator says the same, 1 if not, 2 if it cannot be compared.

    \b
    tickrig record /dev/ttyUSB0 --out run.trace --type rrc --link /tmp/rrc
    tickrig compare run.trace
    tickrig compare run.trace --tolerance 50ms --ignore 'Version*' --number 'EV:batt*=5'
    """  # noqa: D301 - click wants the backspace
