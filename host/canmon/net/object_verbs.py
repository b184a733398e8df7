"""The verbs of `canmon net` about objects: read, write, compare, store, restore and dcf."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.eds_document import node_eds_option, read_number
from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.model.decode.eds_folder import EdsFolder
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.node_objects import (
    Entry,
    NamedObjects,
    difference_text,
    differences,
    encoded,
    known_objects,
    limits,
    shown,
)
from tickrig.host.canmon.net.session import (
    NetSession,
    NodeFailed,
    dry_run_option,
    failure_text,
    net_session,
    of_node,
    print_plan,
)
from tickrig.host.canmon.risks import write_risk
from tickrig.host.canopen.commissioning.configuration import Values, disabled, is_parameter, writes
from tickrig.host.canopen.conform.write_order import Write
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.cli.messages import Refused, refusing, say, until_unread
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.text.page_text import json_text, one_line
from tickrig.host.text.values import counted
from tickrig.wire.canopen.nmt import NmtCommand, NmtState
from tickrig.wire.canopen.sdo_frame import describe_abort

_REFUSED: Final = 1


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("names", nargs=-1, metavar="OBJECT...")
@node_eds_option()
@click.option("--json", "as_json", is_flag=True, help="Print objects as JSON, one per line.")
@click.pass_obj
def read(
    call: NetCall, node: int, names: Sequence[str], eds: Path | EdsFolder | None, as_json: bool
) -> None:
    """Read objects of NODE, by name or index. Without an object, read all that its EDS names.

    Use a name from the EDS, or else from CiA 301 or 402. Write a name from the EDS in small
    letters, and write one _ for each series of characters that are not letters or digits. Examples
    are position_actual_value and identity_object.vendor_id. The exit status is 1 if the node
    refuses an object.

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
    """Return a line with the value, or None if the node refuses. The refusal is reported."""
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


# The verb `net write`: objects of a node.


_MAPPING_OFFSET: Final = 0x200
_PDO_MAPPINGS: Final = (*range(0x1600, 0x1800), *range(0x1A00, 0x1C00))


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("values", nargs=-1, required=True, metavar="OBJECT=VALUE...")
@node_eds_option()
@dry_run_option
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def write(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    node: int,
    values: Sequence[str],
    eds: Path | EdsFolder | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Write objects of NODE, by name or index, in the given order.

    The type of the object decides what VALUE is: a number in decimal or hex (0x1F), a text, or
    bytes in hex. A number is in the unit of the object, if the EDS gives a unit. If the type of the
    object is unknown, write a type before the value, as u16:5. The command stops at the first
    refused object. Earlier objects stay written.

    \b
    canmon net can0 write 5 heartbeat_time=100 --yes
    canmon net can0 write 5 heartbeat_time=100 controlword=6 --dry-run
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
        if dry_run:
            print_plan(*titles)
            return
        risk = write_risk(objects.is_drive, [entry for entry, _, _ in made])
        session.confirm(f"writes to node {node}: {', '.join(titles)}", yes=yes, risk=risk)
        session.work.plan(*titles)
        for title, (entry, _, data) in zip(titles, made, strict=True):
            _write_one(session, objects, entry, data)
            session.work.done()
            say(one_line(f"written: {title}"))


def _split(word: str) -> tuple[str, str]:
    name, equals, text = word.partition("=")
    if not (name and equals):
        raise Refused(f"{word!r} is not OBJECT=VALUE, as heartbeat_time=100 or 2000h:1=u16:5")
    return name, text


def _write_one(session: NetSession, objects: NamedObjects, entry: Entry, data: bytes) -> None:
    node_id = objects.node_id
    with of_node(node_id, objects.title):
        try:
            session.bus.write(node_id, *entry, data)
        except SdoAborted as error:
            why = f"refused: {describe_abort(error.code)}{limits(objects, entry)}{_hint(entry)}"
            raise NodeFailed(f"node {node_id}: {objects.title(entry)}: {why}") from None


def _hint(entry: Entry) -> str:
    """Return a hint for changing the mapping of a PDO, empty for other objects."""
    if entry[0] not in _PDO_MAPPINGS:
        return ""
    return f"; disable the PDO first: {entry[0] - _MAPPING_OFFSET:04X}h:01 with bit 31"


# The verb `net compare`: compare a node with a DCF, or another node.


_DIFFERENT: Final = 1


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("other", metavar="FILE|NODE")
@node_eds_option("EDS, DCF or XDD of both nodes.")
@click.pass_obj
def compare(call: NetCall, node: int, other: str, eds: Path | EdsFolder | None) -> None:
    """Compare NODE with a DCF, or with another node. The exit status is 1 if they differ.

    A DCF is compared by its ParameterValues. A file without ParameterValues, such as an EDS, is
    compared by the defaults of all parameters. For two nodes, all parameters of the EDS are
    compared. If the EDS defines a value as an offset to the node-ID, only the offset is compared.
    Nothing is written.

    \b
    canmon net can0 compare 5 drive.dcf
    canmon net can0 compare 5 6 --eds drive.eds
    """  # noqa: D301 - click wants the backspace
    found = 0
    with net_session(call, node) as session, until_unread():
        other_id = _other_id(other)
        file = eds if other_id else Path(other)
        with of_node(node):
            objects = known_objects(session, node, file, what="--eds" if other_id else "FILE")
        if other_id:
            values, where = _of_node(session, objects, other_id), f"at node {other_id}"
        else:
            values, where = _of_file(objects), "in the file"
        with of_node(node, objects.title):
            for one in differences(session, objects, values):
                found += 1
                click.echo(one_line(difference_text(objects, one, where)))
        say(f"objects that differ: {found} of {len(values)}")
    if found:
        raise click.exceptions.Exit(_DIFFERENT)


def _other_id(word: str) -> int:
    """Return the node-ID that a word contains, or 0 if it is not a node-ID."""
    number = int(word) if word.isascii() and word.isdecimal() else 0
    if number > 127:
        raise Refused(f"{word} is no node-ID 1..127")
    return number


def _default_values(objects: NamedObjects) -> Values:
    """Return the defaults of all parameters that an EDS describes."""
    return {
        at: row.power_on_data(objects.node_id)
        for at, row in objects.rows.items()
        if row.has_default and is_parameter(row)
    }


def _of_file(objects: NamedObjects) -> Values:
    values = objects.dcf_values() or _default_values(objects)
    return {at: data for at, data in values.items() if objects.rows[at].readable}


def _values_of(session: NetSession, node_id: int, entries: Collection[Entry]) -> Values:
    """Read objects of a node. Omit objects that the node refuses."""
    found: Values = {}
    for entry in sorted(entries):
        try:
            found[entry] = session.bus.read(node_id, *entry)
        except SdoAborted:
            continue
    return found


def _of_node(session: NetSession, objects: NamedObjects, other_id: int) -> Values:
    """Return the parameters of another node, converted to the node-ID of this node."""
    rows = {at: row for at, row in objects.rows.items() if is_parameter(row)}
    if not rows:
        raise Refused("which objects? give the EDS of both nodes (--eds FILE)")
    with of_node(other_id, objects.title):
        found = _values_of(session, other_id, rows)
    shift = objects.node_id - other_id
    for at, data in found.items():
        if rows[at].relative and data != bytes(len(data)):
            number = int.from_bytes(data, "little") + shift
            found[at] = (number % (1 << 8 * len(data))).to_bytes(len(data), "little")
    return found


# The verbs `net store` and `net restore`: 1010h and 1011h.


# Store and restore of a node: 1010h and 1011h.

_STORE: Final = 0x1010
_RESTORE: Final = 0x1011
_PATIENCE_US: Final = 10_000_000
"""Longest time until a node that writes its memory answers."""
_BOOT_UP_US: Final = 5_000_000
_ON_COMMAND: Final = 1
"""Bit 0 of 1010h, which is set if the node saves on command."""

_AREAS: Final = {"all": 1, "communication": 2, "application": 3}
_COMMUNICATION: Final = 2


def save(session: NetSession, node_id: int, sub: int) -> None:
    """Make a node store its parameters in non-volatile memory, by a write to 1010h.

    Args:
        session: session with the open bus.
        node_id: node-ID of the node.
        sub: sub-index of 1010h: 1 for all parameters, 2 for the objects 1000h to 1FFFh, 3 for the
            objects 6000h to 9FFFh. Further sub-indices are manufacturer-specific.

    Raises:
        NodeFailed: the node cannot store these parameters.
    """
    _check_saves(session, node_id, sub)
    with of_node(node_id):
        session.bus.write(node_id, _STORE, sub, b"save", _PATIENCE_US)
    say(f"node {node_id}: stored")


def _check_saves(session: NetSession, node_id: int, sub: int) -> None:
    """Check that a node stores on command. Raise NodeFailed if it does not."""
    with of_node(node_id):
        data = session.bus.read(node_id, _STORE, sub)
        if not data[:1] or not data[0] & _ON_COMMAND:
            raise NodeFailed(
                f"node {node_id}: {_STORE:04X}h:{sub:02X} is {data[::-1].hex().upper()}h:"
                " it does not store on command"
            )


def _save_text(sub: int) -> str:
    return f"{write_entry((_STORE, sub))} = 'save'"


def _load_defaults(session: NetSession, node_id: int, sub: int) -> None:
    """Make a node erase stored parameters. The erasure takes effect at the node's next reset."""
    with of_node(node_id):
        session.bus.write(node_id, _RESTORE, sub, b"load", _PATIENCE_US)
    say(f"node {node_id}: restored; the defaults count from its next reset")


def reset(session: NetSession, node_id: int, sub: int) -> None:
    """Reset a node after its parameters were restored, and wait for its boot-up.

    `sub` is the sub-index of 1011h that was written. If only the communication parameters were
    restored, only the communication of the node is reset.
    """
    communication = sub == _COMMUNICATION
    command = NmtCommand.RESET_COMMUNICATION if communication else NmtCommand.RESET_NODE
    session.bus.command(command, node_id)
    wanted = (NmtState.INITIALISING,)
    if session.bus.await_state(node_id, wanted, _BOOT_UP_US) not in wanted:
        raise NodeFailed(f"node {node_id}: no boot-up within {_BOOT_UP_US // 1_000_000} s")
    say(f"node {node_id}: boot-up")


def _sub(word: str) -> int:
    if word in _AREAS:
        return _AREAS[word]
    number = int(word) if word.isascii() and word.isdecimal() else 0
    if not 1 <= number <= 0x7F:
        raise Refused(f"{word!r} is not {', '.join(_AREAS)} or a sub-index 1..127")
    return number


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("area", default="all")
@dry_run_option
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def store(call: NetCall, node: int, area: str, dry_run: bool, yes: bool) -> None:
    """Store parameters of NODE (1010h): all, communication, application or a sub-index.

    \b
    canmon net can0 store 5
    canmon net can0 store 5 --dry-run
    canmon net can0 store 5 communication --yes
    """  # noqa: D301 - click wants the backspace
    sub = _sub(area)
    with net_session(call, node) as session:
        if dry_run:
            _check_saves(session, node, sub)
            print_plan(_save_text(sub))
            return
        session.confirm(f"node {node} stores its parameters: {area}", yes=yes)
        session.work.plan("store")
        save(session, node, sub)
        session.work.done()


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("area", default="all")
@click.option(
    "--reset",
    "then_reset",
    is_flag=True,
    help="Reset the node, so that the defaults apply at once.",
)
@dry_run_option
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def restore(  # noqa: PLR0913, PLR0917 - options
    call: NetCall, node: int, area: str, then_reset: bool, dry_run: bool, yes: bool
) -> None:
    """Restore the defaults of NODE (1011h): all, communication, application or a sub-index.

    The defaults take effect at the next reset of NODE.

    \b
    canmon net can0 restore 5 --reset
    canmon net can0 restore 5 --reset --dry-run
    canmon net can0 restore 5 communication
    """  # noqa: D301 - click wants the backspace
    sub = _sub(area)
    risk = "Limits and gains of a drive become those of its maker"
    if then_reset:
        risk += "; its motor is released: a hanging load may fall"
    with net_session(call, node) as session:
        if dry_run:
            with of_node(node):
                session.bus.read(node, _RESTORE, sub)
            kind = "reset-comm" if sub == _COMMUNICATION else "reset-node"
            reset_text = [f"NMT {kind} to node {node}"] if then_reset else []
            print_plan(f"{write_entry((_RESTORE, sub))} = 'load'", *reset_text)
            return
        session.confirm(f"node {node} forgets its parameters: {area}", yes=yes, risk=risk)
        session.work.plan("restore", *(["reset"] if then_reset else []))
        _load_defaults(session, node, sub)
        session.work.done()
        if then_reset:
            reset(session, node, sub)
            session.work.done()


# The verb `net dcf`: write the configuration of a DCF to a node.


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("file", type=PATH)
@click.option("--all", "whole", is_flag=True, help="Also write unchanged values.")
@click.option(
    "--skip", multiple=True, metavar="OBJECT", help="Do not write OBJECT; may be repeated."
)
@click.option("--store", is_flag=True, help="Store all parameters afterwards (1010h:01).")
@click.option("--other-device", is_flag=True, help="Accept a FILE of another device.")
@dry_run_option
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def dcf(  # noqa: PLR0913, PLR0917 - options
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
    """Write the configuration of the DCF or XDC FILE to NODE.

    The configuration is the ParameterValues of FILE. The command writes only the values that differ
    from the present values of NODE. With --all, the command writes all values. PDOs are disabled
    while they change (CiA 301), and 1020h is written last. The command stops at the first refused
    object, and reports the written objects. A file of another device (1000h, 1018h) is refused.

    \b
    canmon net can0 dcf 5 drive.dcf --dry-run
    canmon net can0 dcf 5 drive.dcf --store --yes
    """  # noqa: D301 - click wants the backspace
    with net_session(call, node) as session:
        with of_node(node):
            objects = known_objects(session, node, file, what="FILE", strict=not other_device)
        values = _dcf_values(objects, file, skip)
        with of_node(node, objects.title):
            changed = values if whole else _changed(session, objects, values)
            steps = _steps(session, objects, changed, file)
        if dry_run:
            print_plan(*_titles(objects, steps), *([_save_text(1)] if steps and store else []))
        if dry_run or not steps:
            return
        what = f"{counted(len(changed), 'object')} of {file.name} to node {node}"
        what += ", then stored" if store else ""
        session.confirm(what, yes=yes, risk=write_risk(objects.is_drive, changed))
        _write_all(session, objects, steps, store=store)


def _dcf_values(objects: NamedObjects, file: Path, skip: Sequence[str]) -> Values:
    left_out = {objects.find(word) for word in skip}
    values = objects.dcf_values()
    if not values:
        raise Refused(f"{file} has no ParameterValue of an object that can be written: no DCF")
    return {at: data for at, data in values.items() if at not in left_out}


def _changed(session: NetSession, objects: NamedObjects, values: Values) -> Values:
    """Return and print the differences of the node."""
    found = list(differences(session, objects, values))
    for one in found:
        click.echo(one_line(difference_text(objects, one, "in the file")))
    say(f"objects that differ: {len(found)} of {len(values)}")
    return {one.entry: one.wanted for one in found}


def _steps(session: NetSession, objects: NamedObjects, changed: Values, file: Path) -> list[Write]:
    """Return the writes. Raise Refused if the file has impossible writes."""
    writable = {at for at, row in objects.rows.items() if row.writable}

    def number(at: Entry) -> int:
        return read_number(session.bus, objects.node_id, *at, objects.size(at)) or 0

    with refusing(f"FILE {file}:"):
        return writes(changed, number, writable)


def _titles(objects: NamedObjects, steps: Sequence[Write]) -> list[str]:
    return [f"{objects.title(at)} = {shown(objects, at, data)}" for at, data in steps]


def _write_all(
    session: NetSession, objects: NamedObjects, steps: Sequence[Write], *, store: bool
) -> None:
    session.work.plan(*_titles(objects, steps), *(["store"] if store else []))
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
