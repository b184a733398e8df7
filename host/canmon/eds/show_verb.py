"""The verb `eds show`: the device of a file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.host.canmon.eds_document import read_device_document
from tickrig.host.canopen.data_sheet.show import diff, entries, head, pdos, table
from tickrig.host.cli.messages import Refused, until_unread
from tickrig.host.cli.options import PATH
from tickrig.host.text.page_text import json_text

if TYPE_CHECKING:
    from tickrig.host.canopen.data_sheet.document import Document


_PLACE: Final = re.compile(r"(?:0x)?([0-9a-f]{4})h?(?::(?:0x)?([0-9a-f]{1,2})h?)?", re.IGNORECASE)
_COLUMNS: Final = ("index", "sub", "type", "access", "default", "low", "high", "name")


@click.command()
@click.argument("file", type=PATH)
@click.argument("place", required=False, metavar="[INDEX[:SUB]]")
@click.option("--node", type=click.IntRange(1, 127), default=1, help="Node-ID of the PDOs.  [1]")
@click.option("--json", "as_json", is_flag=True, help="All of it as one JSON object.")
def show(file: Path, place: str | None, node: int, as_json: bool) -> None:
    """Show the device of an EDS: head, objects, PDOs at power-on.

    Index and sub-index are hexadecimal. `T` and `R` are the PDOs that may carry an
    entry.

    \b
    canmon eds show drive.eds
    canmon eds show drive.eds 6040
    canmon eds show drive.eds 1018:01 --json
    """  # noqa: D301 - click wants the backspace
    index, sub = _place(place)
    said = _describe(read_device_document(file), index, sub, node)
    if index is not None and not said["entries"]:
        raise Refused(f"{file}: no {place} is there")
    with until_unread():
        for line in [json_text(said, letters=True)] if as_json else _lines(said, node):
            click.echo(line)


def _place(text: str | None) -> tuple[int | None, int | None]:
    if text is None:
        return None, None
    match = _PLACE.fullmatch(text)
    if match is None:
        raise Refused(f"{text!r} is not INDEX or INDEX:SUB in hexadecimal, as 6040 or 1018:01")
    return int(match[1], 16), int(match[2], 16) if match[2] else None


def _describe(
    document: Document, index: int | None, sub: int | None, node_id: int
) -> dict[str, Any]:
    """Return what is shown; without the head and the PDOs where one object is wanted."""
    said: dict[str, Any] = {"v": 1, "file": document.name}
    if index is None:
        said["device"] = head(document)
    said["entries"] = entries(document, index, sub)
    if index is None:
        said["pdos"] = pdos(document, node_id)
    return said


def _lines(said: dict[str, Any], node_id: int) -> Iterator[str]:
    for what, value in said.get("device", {}).items():
        if value != "":
            yield f"{what:<14}{value}"
    if "device" in said:
        yield ""
    yield from table(said["entries"], _COLUMNS)
    if said.get("pdos"):
        yield ""
        yield f"PDOs of node {node_id}"
    for pdo in said.get("pdos", ()):
        yield from _pdo_lines(pdo)


def _pdo_lines(pdo: dict[str, Any]) -> Iterator[str]:
    state = "" if pdo["valid"] else ", not valid"
    yield f"{pdo['pdo']:<8}{pdo['can_id']}  type {pdo['transmission']}{state}"
    for each in pdo["mapping"]:
        bits = f"{each['bit']}..{each['bit'] + each['bits'] - 1}"
        yield f"        {bits:<8}{each['object']} {each['name']}".rstrip()


# The verb `eds diff`: what is another device.


_DIFFERENT: Final = 1


@click.command()
@click.argument("old", type=PATH)
@click.argument("new", type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Differences as JSON, one a line.")
def compare(old: Path, new: Path, as_json: bool) -> None:
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
