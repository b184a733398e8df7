"""The command `tickrig demo`; each demonstration stands with its device."""

from __future__ import annotations

from typing import Final

import click

from tickrig.host.cli.lazy_group import LazyGroup

DEMOS: Final = {
    "rrc": (
        "tickrig.emulators.rrc.demo_cli:rrc",
        "Drive an RRC on a pty through power-on, all samples, output mode and a watchdog trip.",
    ),
    "rtc-lite": (
        "tickrig.emulators.rtc_lite.demo.cli:rtc_lite",
        "Send numbers through two emulated PICs, cut the power of one, and see it come back.",
    ),
    "tkernel": (
        "tickrig.emulators.tkernel.demo.cli:tkernel",
        "Let a robot keep its position by ucodes while the service that resolves them is gone.",
    ),
    "fig120": (
        "tickrig.emulators.fig120.cli:fig120",
        "Let a potentiometer at one CANopen node turn the motor of another, without a PC in"
        " between.",
    ),
}


@click.group(cls=LazyGroup, commands=DEMOS, invoke_without_command=True)
@click.pass_context
def demo(context: click.Context) -> None:
    """Show an emulated device and a host at work; each ends by itself.

    Without a name it lists them.
    """
    if context.invoked_subcommand is None:
        for name, (_, what) in DEMOS.items():
            click.echo(f"tickrig demo {name:8}  {what}")
