"""The command `tickrig demo`."""

from __future__ import annotations

import click

from tickrig.emulators.rrc.demo import run_demo
from tickrig.host.errors import DeviceRefused, LinkError


@click.group()
def demo() -> None:
    """Show an emulated device and a host at work; each ends by itself."""


@demo.command()
def rrc() -> None:
    """Drive an RRC on a pty through power-on, all samples, output mode and a watchdog trip."""
    try:
        run_demo(click.echo)
    except (RuntimeError, OSError, LinkError, DeviceRefused) as error:
        raise click.ClickException(str(error)) from error
