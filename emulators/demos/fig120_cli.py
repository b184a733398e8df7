"""The command `tickrig demo fig120`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options, open_raw
from tickrig.host.cli.messages import Refused, refuse_path, warnings_shown
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import load, loading, raise_of_output

if TYPE_CHECKING:
    from tickrig.emulators.demos.fig120 import CurveSample

_WITHIN_A_PROCESS: Final = ("virtual", "tickrig")


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
        load("tickrig.emulators.commands.picture:check_plot")(plot)
    samples = _play(BusOptions(**options))
    if plot is not None:
        try:
            load("tickrig.emulators.demos.fig120:write_plot")(samples, plot)
        except OSError as error:
            refuse_path("plot", error)
        click.echo(f"\nThe curves are in {plot}.")


def _play(bus: BusOptions) -> list[CurveSample]:
    with loading():
        from canopen import SdoCommunicationError  # noqa: PLC0415 - slow

        from tickrig.emulators.demos import fig120 as demo  # noqa: PLC0415 - slow

    try:
        if not bus:
            return demo.run_demo(demo.VirtualStage(), click.echo)
        with warnings_shown():
            if bus.interface in _WITHIN_A_PROCESS:
                raise Refused(
                    f"{bus.interface} is inside one process, and the nodes run in another"
                )
            with demo.bus_stage(bus.arguments(), lambda: open_raw(bus)[0]) as stage:
                return demo.run_demo(stage, click.echo)
    except (RuntimeError, OSError, SdoCommunicationError) as error:
        raise_of_output(error)
        raise click.ClickException(str(error)) from error
