"""The command `rtc-canopen-builder`."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from tickrig.host.cli.messages import NEEDS_YAML, Refused
from tickrig.host.cli.options import PATH, HarmlessCommand, version_option
from tickrig.host.cli.start import load
from tickrig.host.rtc.canopen.builder.profile_file import EXAMPLE


@click.command(cls=HarmlessCommand)
@click.argument("profile", type=PATH, required=False)
@click.option(
    "-o", "--out", type=PATH, metavar="DIR", help="Write the files to DIR; create DIR if needed."
)
@click.option("--force", is_flag=True, help="Overwrite the skeleton, even if you have filled it.")
@click.option("--all", "every", is_flag=True, help="Show all objects, not only those of ports.")
@click.option("--example", is_flag=True, help="Print an example profile, and exit.")
@version_option()
def main(
    profile: Path | None, out: Path | None, *, force: bool, every: bool, example: bool
) -> None:
    """Check the PROFILE of a DeviceRTC, show its objects and PDOs, write its files.

    \b
    NAME.eds     electronic data sheet (CiA 306)
    NAME.py      component for canopen-slave-emu --rtc, callbacks to be filled
    NAME_od.h    object dictionary for a microcontroller, in C
    NAME.yaml    System Definition with this node

    \b
    rtc-canopen-builder --example > gripper.toml
    rtc-canopen-builder gripper.toml
    rtc-canopen-builder gripper.toml --out build
    canopen-slave-emu --rtc build/gripper.py:Gripper --node-id 16 -i socketcan -c vcan0
    """  # noqa: D301 - click wants the backspace
    if example:
        click.echo(EXAMPLE, nl=False)
        return
    if profile is None:
        raise Refused("give a PROFILE, or --example for one to begin with")
    try:
        run_builder = load("tickrig.host.rtc.canopen.builder.build:run_builder")
    except ModuleNotFoundError:
        raise Refused(NEEDS_YAML) from None
    warn = partial(click.echo, err=True)
    for line in run_builder(profile, out, warn, force=force, every=every):
        click.echo(line)
