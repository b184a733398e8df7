"""The verb `net dcf`: what a DCF says goes into a node."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from tickrig.host.canmon.net import node_objects
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import NetSession, net_session, of_node
from tickrig.host.canmon.net.verbs.store_verb import save
from tickrig.host.canmon.risks import write_risk
from tickrig.host.canopen.commissioning.configuration import Values, dcf_values, disabled, writes
from tickrig.host.canopen.conform.write_order import Write
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.cli.messages import Refused, refusing, say
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import counted


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("file", type=PATH)
@click.option("--all", "whole", is_flag=True, help="Write what is there already, too.")
@click.option("--skip", multiple=True, metavar="OBJECT", help="Is not written; may be repeated.")
@click.option("--store", is_flag=True, help="Store all of it then (1010h:01).")
@click.option("--other-device", is_flag=True, help="Though FILE is of another device.")
@click.option("--dry-run", is_flag=True, help="Say what differs; write nothing.")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def command(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    node: int,
    file: Path,
    whole: bool,
    skip: Sequence[str],
    store: bool,
    other_device: bool,
    dry_run: bool,
    yes: bool,
) -> None:
    """Write what the DCF or XDC FILE configures into NODE, as far as it differs.

    That is its ParameterValues. PDOs are disabled while they change, as CiA 301 has it,
    1020h is written last. The first object that is refused ends it, and what was
    written is told. A file of another device (1000h, 1018h) is refused.

    \b
    canmon net can0 dcf 5 drive.dcf --dry-run
    canmon net can0 dcf 5 drive.dcf --store --yes
    """  # noqa: D301 - click wants the backspace
    with net_session(call, node) as session:
        with of_node(node):
            objects = node_objects.known_objects(
                session, node, file, what="FILE", strict=not other_device
            )
        values = _values(objects, skip)
        with of_node(node, objects.title):
            changed = values if whole else _changed(session, objects, values)
            steps = _steps(session, objects, changed, file)
        if dry_run or not steps:
            return
        what = f"{counted(len(changed), 'object')} of {file.name} to node {node}"
        what += ", then stored" if store else ""
        session.confirm(
            what, yes=yes, risk=write_risk(objects.is_drive, [at for at, _ in changed.items()])
        )
        _write(session, objects, steps, store=store)


def _values(objects: node_objects.NamedObjects, skip: Sequence[str]) -> Values:
    file, device = objects.file, objects.device
    assert file is not None
    assert device is not None
    left_out = {objects.find(word) for word in skip}
    values = dcf_values(file, device, objects.node_id)
    if not values:
        raise Refused(f"{file.name} has no ParameterValue of an object that can be written: no DCF")
    return {at: data for at, data in values.items() if at not in left_out}


def _changed(session: NetSession, objects: node_objects.NamedObjects, values: Values) -> Values:
    """Return what differs in the node, and say it."""
    found = list(node_objects.differences(session, objects, values))
    for one in found:
        click.echo(one_line(node_objects.line(objects, one, "in the file")))
    say(f"objects that differ: {len(found)} of {len(values)}")
    return {one.entry: one.wanted for one in found}


def _steps(
    session: NetSession, objects: node_objects.NamedObjects, changed: Values, file: Path
) -> list[Write]:
    """Return what is written; Refused if the file asks for what cannot be."""
    writable = {at for at, row in objects.rows.items() if row.writable}

    def number(at: node_objects.Entry) -> int:
        try:
            data = session.bus.read(objects.node_id, *at, objects.size(at))
        except SdoFailed:
            return 0
        return int.from_bytes(data, "little")

    with refusing(f"FILE {file}:"):
        return writes(changed, number, writable)


def _write(
    session: NetSession,
    objects: node_objects.NamedObjects,
    steps: Sequence[Write],
    *,
    store: bool,
) -> None:
    titles = [
        f"{objects.title(at)} = {node_objects.shown(objects, at, data)}" for at, data in steps
    ]
    session.work.plan(*titles, *(["store"] if store else []))
    for number, (at, data) in enumerate(steps):
        session.work.ending = disabled(steps[:number], steps[number:])
        with of_node(objects.node_id, objects.title):
            session.bus.write(objects.node_id, *at, data)
        session.work.done()
    session.work.ending = ""
    say(f"node {objects.node_id}: {counted(len(steps), 'write')} done")
    if store:
        save(session, objects.node_id, 1)
        session.work.done()
