"""The command `tkernel-emu`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.engine_options import openrtm_options
from tickrig.host.cli.options import PATH, HarmlessCommand, version_option, works_in


@click.command(cls=HarmlessCommand)
@click.argument("system", type=PATH, required=False)
@click.option("--urg", metavar="URL", help="Run the component of the range finder at URL.")
@click.option("--ucode", metavar="URL", help="Run the three components of the ucode reader at URL.")
@click.option(
    "--service", default="", metavar="URL", help="URL of the ucode service. [http://127.0.0.1:8640]"
)
@click.option(
    "--control", type=PATH, help="Control socket of the RT components, for 'tickrig rtc --at'."
)
@click.option("--board", type=PATH, help="Control socket of the board, for 'tickrig ctl'.")
@click.option("--connectors", type=int, default=8, help="Largest number of connectors. [8]")
@click.option(
    "--message-octets",
    type=int,
    default=4_096,
    help="Largest size of a value as CDR, in bytes. [4096]",
)
@click.option("--tick", default="10ms", help="Period of which all others are multiples.  [10ms]")
@click.option("--boot", default="3s", help="Time from power-up until the board answers. [3s]")
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="NAME[@FROM[-TO]]",
    help="Inject a fault: power_cut; may be repeated.",
)
@openrtm_options
@version_option()
@works_in("tickrig.emulators.tkernel.commands.node_run:run_node")
def main(**options: Any) -> None:
    """Emulate a board with OpenRTM on T-Kernel, until Ctrl-C.

    The board runs the RT components of the NEDO report (Figs. 122 and 123), or those of a SYSTEM
    file. The board has limits, such as --connectors and --message-octets. It refuses requests
    beyond these limits with a message. The board does not answer until it has booted. A power cut
    loses everything except files.

    \b
    urg-emu --link /tmp/urg --room 4,3
    tkernel-emu --urg /tmp/urg --control /tmp/node --board /tmp/board
    tickrig rtc ls -l --at /tmp/node
    tickrig ctl /tmp/board fault power_cut
    tkernel-emu --ucode /tmp/ucode --openrtm localhost
    """  # noqa: D301 - click wants the backspace
