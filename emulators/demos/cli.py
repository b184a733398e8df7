"""The commands of `tickrig demo`; the work of each stands in a module of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tickrig.host.cli.can_options import BusCommand, bus_options
from tickrig.host.cli.options import PATH, works_in


@click.command()
@works_in("tickrig.emulators.demos.terminal_cli:show_rrc")
def rrc() -> None:
    """Drive an RRC on a pty through power-on, all samples, output mode and a watchdog trip."""


@click.command("rtc-lite")
@click.option("--virtual", is_flag=True, help="In virtual time: the same lines each time, at once.")
@works_in("tickrig.emulators.demos.terminal_cli:show_rtc_lite")
def rtc_lite(virtual: bool) -> None:
    """Send numbers through two emulated PICs, cut the power of one, and see it come back.

    ConsoleIn, LiteA, LiteB, ConsoleOut: the experiments of the paper on
    RTComponent-Lite. The devices are processes on two ptys, in real time.
    """


@click.command()
@click.option("--no-caches", is_flag=True, help="Entries of the caches do not outlive the outage.")
@works_in("tickrig.emulators.demos.terminal_cli:show_tkernel")
def tkernel(no_caches: bool) -> None:
    """Let a robot keep its position by ucodes while the service that resolves them is gone.

    A cart of Reference Hardware 3 with worn wheels drives along a corridor
    with infra-red markers; a node on T-Kernel reads their ucodes. On the way
    back the resolution service is unreachable, and the caches of the node go
    on. In virtual time: the same lines each time.
    """


@click.command(cls=BusCommand)
@click.option("--plot", type=PATH, help="Draw the curves into FILE.png, .svg or .html.")
@bus_options
@works_in("tickrig.emulators.demos.terminal_cli:show_fig120")
def fig120(plot: Path | None, **options: Any) -> None:
    """Let a potentiometer at one CANopen node turn the motor of another, without a PC in between.

    A master links the analogue input of an f-palette with the reference of a
    motor core unit (PDO linking), starts both and leaves the bus. It runs in
    virtual time; with -i and -c in real time on a bus of python-can.

    \b
    tickrig demo fig120
    tickrig demo fig120 --plot curves.png
    tickrig demo fig120 -i socketcan -c vcan0
    """  # noqa: D301 - click wants the backspace
