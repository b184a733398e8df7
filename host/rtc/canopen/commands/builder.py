"""The command `rtc-canopen-builder`."""

from __future__ import annotations

from pathlib import Path

import click

from tickrig.host.cli.messages import NEEDS_YAML, Refused, refuse_path
from tickrig.host.cli.options import PATH, HarmlessCommand, version_option
from tickrig.host.rtc.canopen.builder.profile_file import EXAMPLE, Project, parse_project
from tickrig.host.rtc.canopen.builder.skeleton import SKELETON_SUFFIX


@click.command(cls=HarmlessCommand)
@click.argument("profile", type=PATH, required=False)
@click.option("--out", type=PATH, metavar="DIR", help="Write the files there; DIR is made.")
@click.option("--force", is_flag=True, help="Overwrite the skeleton, which is yours to fill.")
@click.option("--all", "every", is_flag=True, help="Show every object, not only those of ports.")
@click.option("--example", is_flag=True, help="Print a profile to begin with, and end.")
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
    project, files = _build(profile)
    from tickrig.host.rtc.canopen.builder.build import summary  # noqa: PLC0415 - the extra [rtc]

    if out is not None:
        _write(out, files, force=force)
    for line in summary(project.profile, every=every):
        click.echo(line)


def _build(path: Path) -> tuple[Project, dict[str, str]]:
    try:
        from tickrig.host.rtc.canopen.builder.build import build  # noqa: PLC0415 - the extra [rtc]
    except ModuleNotFoundError:
        raise Refused(NEEDS_YAML) from None
    try:
        project = parse_project(path.read_text("utf-8"))
        return project, build(project)
    except OSError as error:
        refuse_path("profile", error)
    except UnicodeDecodeError:
        raise Refused(f"profile {path}: is no text in UTF-8") from None
    except ValueError as error:
        raise Refused(f"profile {path}: {error}") from None


def _write(folder: Path, files: dict[str, str], *, force: bool) -> None:
    """Write the files; a skeleton that is there may have been filled and is kept."""
    from tickrig.host.text.whole_file import write_whole  # noqa: PLC0415 - a TAB needs none

    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            path = folder / name
            if path.suffix == SKELETON_SUFFIX and path.exists() and not force:
                click.echo(f"{path} is kept; --force overwrites it", err=True)
                continue
            write_whole(path, text)
    except OSError as error:
        refuse_path("file", error)
