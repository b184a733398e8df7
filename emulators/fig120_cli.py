"""The command `tickrig demo fig120`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tickrig.emulators.commands.picture import check_plot
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.messages import refuse_path, warnings_shown
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading, raise_of_output

if TYPE_CHECKING:
    from tickrig.emulators.fig120 import CurveSample


@click.command(cls=BusCommand)
@click.option("--plot", type=PATH, help="Draw the curves into FILE.png, .svg or .html.")
@bus_options
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
    if plot is not None:
        check_plot(plot)
    samples = _play(BusOptions(**options))
    if plot is not None:
        _draw(samples, plot)
        click.echo(f"\nThe curves are in {plot}.")


def _play(bus: BusOptions) -> list[CurveSample]:
    with loading():
        from canopen import SdoCommunicationError  # noqa: PLC0415

        from tickrig.emulators.fig120 import VirtualStage, bus_stage, run_demo  # noqa: PLC0415

    try:
        if not bus:
            return run_demo(VirtualStage(), click.echo)
        with warnings_shown(), bus_stage(bus) as stage:
            return run_demo(stage, click.echo)
    except (RuntimeError, OSError, SdoCommunicationError) as error:
        raise_of_output(error)
        raise click.ClickException(str(error)) from error


def _draw(samples: list[CurveSample], plot: Path) -> None:
    from tickrig.emulators.fig120 import write_plot  # noqa: PLC0415

    try:
        write_plot(samples, plot)
    except OSError as error:
        refuse_path("plot", error)
