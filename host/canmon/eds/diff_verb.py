"""The verb `eds diff`: what is another device."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.eds_document import read_device_document
from tickrig.host.canopen.data_sheet.show import diff
from tickrig.host.cli.messages import until_unread
from tickrig.host.cli.options import PATH
from tickrig.host.text.page_text import json_text

_DIFFERENT: Final = 1


@click.command()
@click.argument("old", type=PATH)
@click.argument("new", type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Differences as JSON, one a line.")
def command(old: Path, new: Path, as_json: bool) -> None:
    """Compare the devices of two EDS files; exit status 1 if they differ.

    Objects, entries and their fields, identity, bit rates; not the text. -, + and ~
    are what only the first one has, only the second one, and what differs.

    \b
    canmon eds diff old.eds new.eds
    canmon eds diff drive.eds drive.xdd --json
    """  # noqa: D301 - click wants the backspace
    changes = diff(read_device_document(old), read_device_document(new))
    with until_unread():
        for change in changes:
            said = {"v": 1, **change._asdict()}
            click.echo(json_text(said, letters=True) if as_json else str(change))
    if changes:
        click.get_current_context().exit(_DIFFERENT)
