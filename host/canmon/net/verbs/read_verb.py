"""The verb `net read`: objects of a node."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.node_objects import Entry, NamedObjects, known_objects, shown
from tickrig.host.canmon.net.session import NetSession, failure_text, net_session, of_node
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.cli.messages import Refused, say, until_unread
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.text.page_text import json_text, one_line

_REFUSED: Final = 1


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("names", nargs=-1, metavar="OBJECT...")
@click.option("--eds", type=PATH, metavar="FILE", help="EDS, DCF or XDD of the node.")
@click.option("--json", "as_json", is_flag=True, help="Objects as JSON, one a line.")
@click.pass_obj
def command(
    call: NetCall, node: int, names: Sequence[str], eds: Path | None, as_json: bool
) -> None:
    """Read objects of NODE, by name or index; without any all that its EDS names.

    A name is that of the EDS in small letters with _ for what is no letter, as
    position_actual_value or identity_object.vendor_id, else that of CiA 301 or 402.
    Exit status 1 if the node refuses one.

    \b
    canmon net can0 read 5 statusword 1018h:1 --eds drive.eds
    canmon net can0 read 5 --eds drive.eds
    """  # noqa: D301 - click wants the backspace
    refused: list[Entry] = []
    with net_session(call, node) as session, until_unread():
        with of_node(node):
            objects = known_objects(session, node, eds)
        with of_node(node, objects.title):
            for entry in _wanted(objects, names):
                line = _read(session, objects, entry, as_json)
                refused += [] if line else [entry]
                if line:
                    click.echo(line)
    if refused:
        raise click.exceptions.Exit(_REFUSED)


def _wanted(objects: NamedObjects, names: Sequence[str]) -> list[Entry]:
    if names:
        return [objects.find(name) for name in names]
    if not objects.rows:
        raise Refused("which objects? name them, or give the EDS (--eds FILE) for all of it")
    return [at for at, row in sorted(objects.rows.items()) if row.readable]


def _read(session: NetSession, objects: NamedObjects, entry: Entry, as_json: bool) -> str | None:
    """Return a line with the value; None if the node refuses, which is told."""
    node_id = objects.node_id
    try:
        data = session.bus.read(node_id, *entry, objects.size(entry))
    except SdoAborted as error:
        text = failure_text(error, objects.title)
        say(one_line(f"node {node_id}: {text}"))
        return None
    if not as_json:
        return one_line(f"{objects.title(entry)} = {shown(objects, entry, data)}")
    value = objects.text(entry).read(data)[0]
    said = {"v": 1, "node": node_id, "index": entry[0], "sub": entry[1]}
    more = {"name": objects.text(entry).name, "data": data.hex(), "unit": objects.text(entry).unit}
    return json_text({**said, **more, "value": value if not isinstance(value, bytes) else None})
