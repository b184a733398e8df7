"""The command `rtc-canopen-editor`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.messages import Refused
from tickrig.host.cli.options import PATH, version_option
from tickrig.host.cli.start import load
from tickrig.host.rtc.canopen.commands.server import component_option


@click.command(cls=BusCommand)
@click.argument("file", type=PATH)
@bus_options
@component_option
@click.option("--log", type=PATH, help="Write the events to a file, one JSON object per line.")
@click.option("--start", is_flag=True, help="Activate all nodes in the start order.")
@version_option()
def main(
    file: Path, log: Path | None, components: Sequence[str], *, start: bool, **options: Any
) -> None:
    """Run a CANopen system, and show and change it on the terminal (extra tickrig[tui]).

    FILE is the System Definition: YAML or JSON that describes the CANopen nodes of a system and
    their connections. The editor contains the server of rtc-canopen-server, and shows the running
    system on the terminal. The terminal shows nodes and proxies, their objects with live read and
    write, connections through the PC, and PDO links. Changes are saved only on demand. F1 shows the
    keys.

    \b
    rtc-canopen-editor robot.yaml
    rtc-canopen-editor robot.yaml -i socketcan -c vcan0 --start --log events.jsonl
    rtc-canopen-editor robot.yaml --component Logger0=parts.py:Logger
    """  # noqa: D301 - click wants the backspace
    try:
        run_editor = load("tickrig.host.rtc.canopen.commands.editor_run:run_editor")
    except ImportError as error:
        raise Refused(f"the editor needs Textual: pip install 'tickrig[tui]' ({error})") from None
    run_editor(file, log, components, start, BusOptions(**options))
