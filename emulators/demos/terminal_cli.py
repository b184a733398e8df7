"""What the commands of `tickrig demo` do on the terminal; each loads no other demonstration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.cli.messages import Refused, failing, refuse_path, warnings_shown

if TYPE_CHECKING:
    import canopen

    from tickrig.emulators.commands import picture
    from tickrig.emulators.demos import fig120, rrc, rtc_lite, tkernel
    from tickrig.host.links import link
    from tickrig.host.rtc import states
else:
    canopen, link = LazyModule("canopen"), LazyModule("tickrig.host.links.link")
    states = LazyModule("tickrig.host.rtc.states")
    picture = LazyModule("tickrig.emulators.commands.picture")
    fig120 = LazyModule("tickrig.emulators.demos.fig120")
    rrc = LazyModule("tickrig.emulators.demos.rrc")
    rtc_lite = LazyModule("tickrig.emulators.demos.rtc_lite")
    tkernel = LazyModule("tickrig.emulators.demos.tkernel")

_WITHIN_A_PROCESS: Final = ("virtual", "tickrig")


def show_rrc() -> None:
    """Run the demonstration of the RRC, in real time."""
    with failing(RuntimeError, OSError, link.LinkError, link.DeviceRefused):
        rrc.run_demo(click.echo)


def show_rtc_lite(*, virtual: bool) -> None:
    """Run the demonstration of RTC-Lite, in virtual time or in real time."""
    with failing(RuntimeError, OSError, link.LinkError, states.RtcRefused):
        if virtual:
            rtc_lite.run_demo(rtc_lite.VirtualSetup(), click.echo)
            return
        with warnings_shown(), rtc_lite.pty_setup() as setup:
            rtc_lite.run_demo(setup, click.echo)


def show_tkernel(*, no_caches: bool) -> None:
    """Run the demonstration of the T-Kernel node, in virtual time."""
    tkernel.run_demo(tkernel.CorridorStage(caches=not no_caches), click.echo)


def show_fig120(plot: Path | None, **options: Any) -> None:
    """Run the demonstration of Fig. 120, and draw its curves into a file."""
    if plot is not None:
        picture.check_plot(plot)
    samples = _play(BusOptions(**options))
    if plot is not None:
        try:
            fig120.write_plot(samples, plot)
        except OSError as error:
            refuse_path("plot", error)
        click.echo(f"\nThe curves are in {plot}.")


def _play(bus: BusOptions) -> list[fig120.CurveSample]:
    with failing(RuntimeError, OSError, canopen.SdoCommunicationError):
        if not bus:
            return fig120.run_demo(fig120.VirtualStage(), click.echo)
        with warnings_shown():
            if bus.interface in _WITHIN_A_PROCESS:
                raise Refused(
                    f"{bus.interface} is inside one process, and the nodes run in another"
                )
            with fig120.bus_stage(bus.arguments(), lambda: open_raw(bus)[0]) as stage:
                return fig120.run_demo(stage, click.echo)
