"""The command `tickrig demo rrc`."""

from __future__ import annotations

import click

from tickrig.host.cli.start import load, loading, raise_of_output
from tickrig.host.links.link import DeviceRefused, LinkError


@click.command()
def rrc() -> None:
    """Drive an RRC on a pty through power-on, all samples, output mode and a watchdog trip."""
    with loading():
        run_demo = load("tickrig.emulators.demos.rrc:run_demo")
    try:
        run_demo(click.echo)
    except (RuntimeError, OSError, LinkError, DeviceRefused) as error:
        raise_of_output(error)
        raise click.ClickException(str(error)) from error
