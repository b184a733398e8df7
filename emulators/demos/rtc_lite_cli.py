"""The command `tickrig demo rtc-lite`."""

from __future__ import annotations

from importlib import import_module

import click

from tickrig.host.cli.messages import warnings_shown
from tickrig.host.cli.start import loading, raise_of_output
from tickrig.host.links.link import LinkError
from tickrig.host.rtc.states import RtcRefused


@click.command("rtc-lite")
@click.option("--virtual", is_flag=True, help="In virtual time: the same lines each time, at once.")
def rtc_lite(virtual: bool) -> None:
    """Send numbers through two emulated PICs, cut the power of one, and see it come back.

    ConsoleIn, LiteA, LiteB, ConsoleOut: the experiments of the paper on
    RTComponent-Lite. The devices are processes on two ptys, in real time.
    """
    with loading():
        demo = import_module("tickrig.emulators.demos.rtc_lite")
    try:
        if virtual:
            demo.run_demo(demo.VirtualSetup(), click.echo)
            return
        with warnings_shown(), demo.pty_setup() as setup:
            demo.run_demo(setup, click.echo)
    except (RuntimeError, OSError, LinkError, RtcRefused) as error:
        raise_of_output(error)
        raise click.ClickException(str(error)) from error
