"""The verb `net compare`: a node held against a DCF, or another node."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.net import node_objects
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import NetSession, net_session, of_node
from tickrig.host.canopen.commissioning.configuration import (
    Values,
    dcf_values,
    default_values,
    is_parameter,
)
from tickrig.host.cli.messages import Refused, say, until_unread
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.text.page_text import one_line

_DIFFERENT: Final = 1


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("other", metavar="FILE|NODE")
@click.option("--eds", type=PATH, metavar="FILE", help="EDS, DCF or XDD of both nodes.")
@click.pass_obj
def command(call: NetCall, node: int, other: str, eds: Path | None) -> None:
    """Compare NODE with a DCF, or with another node; exit status 1 if they differ.

    Of a DCF its ParameterValues count; of a file without any, as an EDS, the defaults of
    all parameters. Of two nodes all parameters of the EDS are compared; values that are
    relative to the node-ID in the EDS are compared without it. Nothing is written.

    \b
    canmon net can0 compare 5 drive.dcf
    canmon net can0 compare 5 6 --eds drive.eds
    """  # noqa: D301 - click wants the backspace
    found = 0
    with net_session(call, node) as session, until_unread():
        other_id = _node_id(other)
        file = eds if other_id else Path(other)
        with of_node(node):
            objects = node_objects.known_objects(
                session, node, file, what="--eds" if other_id else "FILE"
            )
        if other_id:
            values, where = _of_node(session, objects, other_id), f"at node {other_id}"
        else:
            values, where = _of_file(objects), "in the file"
        with of_node(node, objects.title):
            for one in node_objects.differences(session, objects, values):
                found += 1
                click.echo(one_line(node_objects.line(objects, one, where)))
        say(f"objects that differ: {found} of {len(values)}")
    if found:
        raise click.exceptions.Exit(_DIFFERENT)


def _node_id(word: str) -> int:
    """Return the node-ID that a word is, 0 if it is none."""
    number = int(word) if word.isascii() and word.isdecimal() else 0
    if number > 127:
        raise Refused(f"{word} is no node-ID 1..127")
    return number


def _of_file(objects: node_objects.NamedObjects) -> Values:
    assert objects.file is not None
    assert objects.device is not None
    node_id = objects.node_id
    values = dcf_values(objects.file, objects.device, node_id)
    values = values or default_values(objects.device, node_id)
    return {at: data for at, data in values.items() if objects.rows[at].readable}


def _of_node(session: NetSession, objects: node_objects.NamedObjects, other_id: int) -> Values:
    """Return the parameters of another node, as this one would have them."""
    rows = {at: row for at, row in objects.rows.items() if is_parameter(row)}
    if not rows:
        raise Refused("which objects? give the EDS of both nodes (--eds FILE)")
    with of_node(other_id, objects.title):
        found = node_objects.values_of(session, other_id, rows)
    shift = objects.node_id - other_id
    for at, data in found.items():
        if rows[at].relative and data != bytes(len(data)):
            number = int.from_bytes(data, "little") + shift
            found[at] = (number % (1 << 8 * len(data))).to_bytes(len(data), "little")
    return found
