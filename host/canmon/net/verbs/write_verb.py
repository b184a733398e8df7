"""The verb `net write`: objects of a node."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.node_objects import Entry, NamedObjects, encoded, known_objects, limits
from tickrig.host.canmon.net.session import NetSession, NodeFailed, net_session, of_node
from tickrig.host.canmon.risks import write_risk
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.text.page_text import one_line
from tickrig.wire.canopen.sdo_frame import describe_abort

_MAPPING_OFFSET: Final = 0x200
_PDO_MAPPINGS: Final = (*range(0x1600, 0x1800), *range(0x1A00, 0x1C00))


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("values", nargs=-1, required=True, metavar="OBJECT=VALUE...")
@click.option("--eds", type=PATH, metavar="FILE", help="EDS, DCF or XDD of the node.")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def command(call: NetCall, node: int, values: Sequence[str], eds: Path | None, yes: bool) -> None:
    """Write objects of NODE, by name or index, in this order.

    Values are decimal, hex (0x1F), in the unit of the object where its EDS gives one,
    texts, or bytes in hex. Where no type is known it stands before the value: u16:5.
    The first that is refused ends it; those before it stay written.

    \b
    canmon net can0 write 5 heartbeat_time=100 --yes
    canmon net can0 write 5 2000h:1=u16:0x1F 1008h=text:left
    canmon net can0 write 5 controlword=15 target_velocity=100 --eds drive.eds
    """  # noqa: D301 - click wants the backspace
    pairs = list(map(_split, values))
    with net_session(call, node) as session:
        with of_node(node):
            objects = known_objects(session, node, eds)
        writes = [(objects.find(name), text) for name, text in pairs]
        made = [(entry, text, encoded(objects, entry, text)) for entry, text in writes]
        titles = [f"{objects.title(entry)} = {text}" for entry, text, _ in made]
        risk = write_risk(objects.is_drive, [entry for entry, _, _ in made])
        session.confirm(f"writes to node {node}: {', '.join(titles)}", yes=yes, risk=risk)
        session.work.plan(*titles)
        for title, (entry, _, data) in zip(titles, made, strict=True):
            _write(session, objects, entry, data)
            session.work.done()
            say(one_line(f"written: {title}"))


def _split(word: str) -> tuple[str, str]:
    name, equals, text = word.partition("=")
    if not (name and equals):
        raise Refused(f"{word!r} is not OBJECT=VALUE, as heartbeat_time=100 or 2000h:1=u16:5")
    return name, text


def _write(session: NetSession, objects: NamedObjects, entry: Entry, data: bytes) -> None:
    node_id = objects.node_id
    with of_node(node_id, objects.title):
        try:
            session.bus.write(node_id, *entry, data)
        except SdoAborted as error:
            why = f"refused: {describe_abort(error.code)}{limits(objects, entry)}{_hint(entry)}"
            raise NodeFailed(f"node {node_id}: {objects.title(entry)}: {why}") from None


def _hint(entry: Entry) -> str:
    """Say what a PDO wants before its mapping is changed; empty for other objects."""
    if entry[0] not in _PDO_MAPPINGS:
        return ""
    return f"; disable the PDO first: {entry[0] - _MAPPING_OFFSET:04X}h:01 with bit 31"
