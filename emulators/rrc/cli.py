"""The command `rrc-emu`."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.device.rrc.config import RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.emulator import Emulator
from tickrig.emulators.rrc.build import NAME, config_to_trace
from tickrig.emulators.serial_options import serial_options
from tickrig.emulators.serial_run import Kind, Options, SerialRun
from tickrig.emulators.trace import Mark
from tickrig.emulators.wire_log import WireLine
from tickrig.wire.rrc.check import check_digit

EVENTS: Final = (b"EV:", b"ER:")


def _with_check(text: bytes) -> bytes:
    return text + check_digit(text) + b"\n"


def _is_event(line: WireLine) -> bool:
    return line.mark is Mark.FROM_DEVICE and line.data.startswith(EVENTS)


def _panel(emulator: Emulator) -> None:
    from tickrig.emulators.rrc.panel_run import run_panel  # noqa: PLC0415 - the extra [tui]

    run_panel(emulator)


KIND: Final = Kind(NAME, "RRC", {"check": _with_check}, _is_event, _panel)


@click.command()
@click.option(
    "--power-on-event",
    type=click.Choice(["PowerOnTrigger", "PowerOn"]),
    default="PowerOnTrigger",
    help="Name of the power-on event, as in the field or as in the manual.",
)
@serial_options
@click.pass_context
def main(context: click.Context, /, power_on_event: str, **options: Any) -> None:
    """Emulate an RRC, with the VR2 wheelchair around it, on a pseudo-terminal.

    It runs in real time until Ctrl-C. A scenario alone runs in virtual time:
    as fast as it goes, with the same transcript each time, exit status 1 if
    something expected did not come. Together with --link or --control it is
    played in real time.

    \b
    rrc-emu --link /tmp/rrc --control /tmp/rrc.ctl
    tickrig ctl /tmp/rrc.ctl press power_button
    rrc-emu --scenario drive.txt
    echo '1s press power_button' | rrc-emu --link /tmp/rrc --scenario -
    rrc-emu --link /tmp/rrc --fault flip=0.001 --fault cut@5s-7s -v
    """  # noqa: D301 - click wants the backspace
    config = RrcConfig(power_on_event=power_on_event)
    run = SerialRun(KIND, Rrc(config), config_to_trace(config), Options(**options))
    context.exit(run.run())
