"""The verbs of `canmon net` about nodes, which are scan, nmt and boot."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from errno import EISDIR, ENOENT
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.conform.conform_source import RIG_FILE
from tickrig.host.canmon.eds_document import (
    chosen_eds,
    eds_folder_option,
    node_eds_option,
    read_device_document,
    read_eds_folders,
)
from tickrig.host.canmon.model.decode.eds_folder import EdsFolder, node_identity
from tickrig.host.canmon.model.decode.node_board import profile_text
from tickrig.host.canmon.model.decode.node_memory import slug
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.node_objects import DEVICE_TYPE, NamedObjects
from tickrig.host.canmon.net.session import (
    NetSession,
    NodeFailed,
    dry_run_option,
    net_session,
    print_plan,
)
from tickrig.host.canmon.risks import NMT_WORDS, nmt_risk, write_risk
from tickrig.host.canopen.bus_file.bus_file import decode_bus_file, read_bus_file
from tickrig.host.canopen.commissioning.configuration import writes
from tickrig.host.canopen.commissioning.node_bus import NetworkScan, NodeFound
from tickrig.host.canopen.dialogue import Script
from tickrig.host.canopen.errors import SdoAborted, SdoFailed
from tickrig.host.canopen.master import boot_slave
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.boot_slave import BootStatus
from tickrig.host.canopen.master.from_bus_file import plan_of
from tickrig.host.cli.messages import Refused, refuse_path, refusing, say, until_unread
from tickrig.host.cli.options import NODE_ID, PATH, Choice, time_option
from tickrig.host.text.page_text import json_text, one_line
from tickrig.host.text.values import counted, format_time
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.canopen.nmt import ALL_NODES, RESETS, NmtCommand, NmtState

if TYPE_CHECKING:
    from tickrig.host.canmon import workspace as workspace_file
    from tickrig.host.canmon.model.check import learnt
else:  # for scan with these options alone
    workspace_file = LazyModule("tickrig.host.canmon.workspace")
    learnt = LazyModule("tickrig.host.canmon.model.check.learnt")

_NOBODY: Final = 1
_WAIT_US: Final = 500_000


@click.command()
@time_option("--wait", "wait_us", help="Wait TIME for the last answers and heartbeats. [500ms]")
@click.option("--json", "as_json", is_flag=True, help="Print nodes as JSON, one per line.")
@click.option(
    "--write", "bus_file", type=PATH, metavar="FILE", help="Write the nodes to a bus.yml."
)
@click.option("--workspace", type=PATH, metavar="FILE", help="Write a workspace for canmon tui.")
@click.option("--rules", type=PATH, metavar="FILE", help="Write rules for canmon check.")
@eds_folder_option
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@click.pass_obj
def scan(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    wait_us: int | None,
    as_json: bool,
    bus_file: Path | None,
    workspace: Path | None,
    rules: Path | None,
    eds_folders: tuple[Path, ...],
    force: bool,
) -> None:
    """List the nodes on the bus. The exit status is 1 if there are none.

    The device type (1000h) of each node-ID is read by SDO. Nothing is changed. Nodes that only send
    other frames are listed too. The state is known for nodes with a heartbeat.

    \b
    canmon net can0 scan
    canmon net can0 scan --wait 2s --json
    canmon net can0 scan --write bus.yml --eds-dir eds
    canmon net can0 scan --workspace bench.toml --rules rules.toml

    --write makes a bus.yml for `boot --bus` and `tickrig check`. It takes the EDS and the name of
    each node from --eds-dir. A node without an EDS is a comment in the file. --workspace makes a
    file for `canmon tui -w` with the bus and the EDS of each node. --rules makes a file for `canmon
    check LOG FILE` with the nodes, their identities and their heartbeats (1017h).
    """  # noqa: D301 - click wants the backspace
    paths = {"--write": bus_file, "--workspace": workspace, "--rules": rules}
    folder = _writing(paths, eds_folders, force=force)
    found: list[NodeFound] = []
    with net_session(call) as session:
        scan = NetworkScan(session.bus, wait_us or _WAIT_US)
        found += scan.run()
    with until_unread():
        for node in found:
            click.echo(_json(node) if as_json else one_line(_line(node)))
    if scan.unconfigured:
        say("nodes without a node-ID are there: canmon net SOURCE lss")
    if not found:
        say("no node answered or sent anything")
        raise click.exceptions.Exit(_NOBODY)
    say(counted(len(found), "node"))
    if rules is not None:
        _write_rules(rules, call, found)
    files: dict[int, Path | None] = {}
    if folder is not None:
        without = "not written: " * bool(bus_file)
        files = {node.node_id: _eds_of(node, folder, without) for node in found}
    if workspace is not None:
        _write_workspace(workspace, call, files, eds_folders)
    if bus_file is not None:
        _write_bus_file(bus_file, found, files, folder)


def _line(node: NodeFound) -> str:
    state = "" if node.state is None else boot_slave.state_text(node.state)
    if not node.answers:
        return f"{node.node_id:>3}  {state}  does not answer"
    words = [f"{node.node_id:>3}", f"{_kind(node.device_type):<14}", _identity(node), node.name]
    if node.answers > 1:
        words.append(f"answered {node.answers} times: as many nodes have this node-ID")
    return "  ".join(word for word in (*words, state) if word)


def _kind(device_type: int | None) -> str:
    return "no 1000h" if device_type is None else profile_text(device_type)


def _identity(node: NodeFound) -> str:
    return ":".join("-" if part is None else f"{part:08X}" for part in node.identity)


def _json(node: NodeFound) -> str:
    return json_text(
        {
            "v": 1,
            "node": node.node_id,
            "device_type": node.device_type,
            "identity": list(node.identity),
            "name": node.name,
            "state": None if node.state is None else boot_slave.state_text(node.state),
            "answers": node.answers,
        }
    )


# What a scan writes. A bus.yml needs an EDS for each node, so a node without one is a
# comment. Vendor and product are those of the EDS, which fits by them; the serial number is not
# checked, because a spare part has another one.

_FIRST_LETTER: Final = re.compile(r"[a-z]")
_MOST_LETTERS: Final = 40
_REVISION: Final = (0x1018, 3)


def _writing(
    paths: Mapping[str, Path | None], folders: tuple[Path, ...], *, force: bool
) -> EdsFolder | None:
    """Return the folder of EDS files. Raise Refused if a file cannot be written."""
    wanted = {option: path for option, path in paths.items() if path is not None}
    if folders and wanted.keys() <= {"--rules"}:
        raise Refused("--eds-dir is for --write FILE, or --workspace FILE")
    if force and not wanted:
        raise Refused("--force is for --write FILE, --workspace FILE or --rules FILE")
    if "--write" in wanted and not folders:
        raise Refused("--write: a bus.yml needs the EDS of each node: give --eds-dir DIR")
    if len({path.resolve() for path in wanted.values()}) < len(wanted):
        raise Refused(
            f"{', '.join(wanted)}: the same file for several options: choose another name"
        )
    for option, path in wanted.items():
        if path.is_dir() or not path.parent.is_dir():
            wrong, why = (path, EISDIR) if path.is_dir() else (path.parent, ENOENT)
            refuse_path(option, OSError(why, os.strerror(why), str(wrong)))
        if path.exists() and not force:
            raise Refused(f"{option} {path} is there already: choose another name, or give --force")
    return read_eds_folders(folders) if folders else None


def _write_workspace(
    path: Path, call: NetCall, files: Mapping[int, Path | None], folders: tuple[Path, ...]
) -> None:
    """Write a workspace with the bus, the EDS of each node, and the folders for other nodes."""
    is_rig = call.word is not None and call.word.lower().endswith(RIG_FILE)
    if is_rig:
        say(one_line(f"{path}: canmon tui cannot open {call.word}: the workspace has no source"))
    source = () if call.word is None or is_rig else (call.word,)
    eds = {node: file for node, file in files.items() if file is not None}
    setup = workspace_file.MonitorSetup(source=source, options=call.bus, eds=eds, eds_dir=folders)
    try:
        workspace = workspace_file.Workspace("", path)
        setup.write(workspace)
        workspace.write(over=True)
    except workspace_file.WorkspaceError as error:
        raise Refused(one_line(f"--workspace {error}")) from None
    say(one_line(f"{path}: {counted(len(eds), 'EDS file')} written"))


def _write_rules(path: Path, call: NetCall, found: list[NodeFound]) -> None:
    """Write the nodes, their identities and their heartbeats as rules."""
    nodes = {node.node_id: (node.identity, node.heartbeat_ms) for node in found}
    head = [
        "Written by canmon net scan. Check a log against these rules: canmon check LOG FILE",
        "The identity of a node is judged only if the log contains a read of 1018h.",
    ]
    name = call.word or str(call.bus.channel or call.bus.interface or "bus")
    with refusing("--rules"):
        write_whole(path, learnt.scanned_text(one_line(name), nodes, head))
    say(one_line(f"{path}: {counted(len(nodes), 'node')} written"))


def _write_bus_file(
    path: Path,
    found: list[NodeFound],
    files: Mapping[int, Path | None],
    folder: EdsFolder | None,
) -> None:
    """Write the nodes that have an EDS.

    Raise Refused without writing if the file would have errors.
    """
    taken = {node.node_id for node in found}
    master = next((one for one in (1, *range(127, 1, -1)) if one not in taken), None)
    if master is None:
        raise Refused("--write: all node-IDs are taken: none is left for the master")
    if not any(files.values()):
        raise Refused(f"--write {path}: no node has an EDS in {folder}: nothing written")
    lines = [
        "# Written by canmon net scan. To check it: tickrig check FILE",
        "master:",
        f"  node_id: {master}",
        "nodes:",
    ]
    for node in found:
        eds = files[node.node_id]
        lines += _no_eds_lines(node) if eds is None else _node_lines(node, eds, path.parent)
    text = "\n".join(lines) + "\n"
    try:
        errors = decode_bus_file(text.encode("utf-8", "backslashreplace"), path).errors
    except ImportError:  # without PyYAML it cannot be checked
        errors = ()
    if errors:
        raise Refused(one_line(f"--write {path}: nothing written: {errors[0]}"))
    with refusing("--write"):
        write_whole(path, text)
    count = sum(eds is not None for eds in files.values())
    say(one_line(f"{path}: {counted(count, 'node')} written"))


def _eds_of(node: NodeFound, folder: EdsFolder, without: str) -> Path | None:
    """Return the EDS of a node.

    Print a line with the chosen file, or the reason why there is none.
    """
    identity = node_identity(node.identity[:3]) if node.answers else None
    if identity is None:
        say(f"node {node.node_id}: {without}it does not send vendor and product (1018h)")
        return None
    choice = folder.choose(node.node_id, identity)
    if choice is None:
        say(one_line(f"node {node.node_id}: {without}no EDS in {folder} for {identity}"))
        return None
    say(choice.said(node.node_id))
    return choice.path


def _node_lines(node: NodeFound, eds: Path, folder: Path) -> list[str]:
    """Return the section of a node as lines."""
    document = read_device_document(eds, "--eds-dir")
    name = slug(document.device.info.product_name or node.name)[:_MOST_LETTERS] or "node"
    if not _FIRST_LETTER.match(name):  # YAML takes 1_5 for a number
        name = f"node_{name}"
    try:
        there = os.path.relpath(eds.resolve(), folder.resolve())
    except ValueError:  # another drive of Windows
        there = str(eds.resolve())
    lines = [f"  {name}_{node.node_id}:", f"    node_id: {node.node_id}"]
    lines.append(f"    dcf: {json.dumps(there, ensure_ascii=False)}")
    revision, serial = node.identity[2:]
    if revision and _REVISION in document.rows:
        lines.append(f"    revision_number: 0x{revision:08X}")
    if serial:
        lines.append(f"    serial_number: 0 # not checked; it has 0x{serial:08X}")
    if node.answers > 1:
        lines.append(f"    # {node.answers} nodes answered with this node-ID")
    return lines


def _no_eds_lines(node: NodeFound) -> list[str]:
    said = f"{_identity(node)} {json.dumps(node.name)}" if node.answers else "does not answer"
    return [f"  # node {node.node_id}, without an EDS: {said}"]


# The verb `net nmt`: NMT commands and their effect.


_AFTER: Final = {
    NmtCommand.START: (NmtState.OPERATIONAL,),
    NmtCommand.STOP: (NmtState.STOPPED,),
    NmtCommand.ENTER_PRE_OPERATIONAL: (NmtState.PRE_OPERATIONAL,),
    NmtCommand.RESET_NODE: (NmtState.INITIALISING,),
    NmtCommand.RESET_COMMUNICATION: (NmtState.INITIALISING,),
}
_ALL: Final = "all"

_BOOT_UP_US: Final = 5_000_000
_LISTEN_US: Final = 1_500_000
_PERIODS: Final = 3
"""Number of heartbeat periods to wait for a state."""


@click.command()
@click.argument("word", type=Choice(list(NMT_WORDS)), metavar="COMMAND")
@click.argument("node", metavar="NODE|all")
@dry_run_option
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def nmt(call: NetCall, word: str, node: str, dry_run: bool, yes: bool) -> None:
    """Send an NMT command to NODE, or to all: start, stop, pre-op, reset-node, reset-comm.

    After sending, the command waits for the state, or after a reset for the boot-up. Only a node
    with a heartbeat (1017h) reports its state. The exit status is 1 if the node reports another
    state, does not boot, or does not answer.

    \b
    canmon net can0 nmt start 5
    canmon net can0 nmt reset-node 5 --dry-run
    canmon net can0 nmt reset-node all --yes
    """  # noqa: D301 - click wants the backspace
    command, node_id = NMT_WORDS[word], _node_id(node)
    with net_session(call, node_id or None) as session:
        if dry_run:
            to = f"node {node_id}" if node_id else "all nodes"
            print_plan(f"NMT {word} to {to} (000#{command:02X}{node_id:02X})")
        elif node_id == ALL_NODES:
            _command_all(session, command, word, yes=yes)
        else:
            _command_one(session, command, word, node_id, yes=yes)


def _node_id(word: str) -> int:
    if word.lower() == _ALL:
        return ALL_NODES
    if not (word.isascii() and word.isdecimal() and 1 <= int(word) <= 127):
        raise Refused(f"{word!r} is no node-ID 1..127, and not all")
    return int(word)


def _command_one(
    session: NetSession, command: NmtCommand, word: str, node_id: int, *, yes: bool
) -> None:
    device_type, heartbeat_ms = _number(session, node_id, 0x1000), _number(session, node_id, 0x1017)
    known = device_type is not None or node_id in session.bus.states
    risk = nmt_risk(command, device_type)
    session.confirm(f"NMT {word} to node {node_id}", yes=yes, risk=risk)
    session.work.plan(f"NMT {word} to node {node_id}")
    session.bus.command(command, node_id)
    session.work.done()
    wanted, wait_us = _AFTER[command], _LISTEN_US
    if command in RESETS:
        wait_us = _BOOT_UP_US
    elif heartbeat_ms:
        wait_us = max(_PERIODS * heartbeat_ms * 1_000, _LISTEN_US)
    state = session.bus.await_state(node_id, wanted, wait_us)
    if state in wanted:
        say(f"node {node_id}: {boot_slave.state_text(wanted[0])}")
    elif state is not None:
        is_in, not_in = map(boot_slave.state_text, (state, wanted[0]))
        raise NodeFailed(f"node {node_id} is {is_in}, not {not_in}")
    elif command in RESETS:
        raise NodeFailed(f"node {node_id}: no boot-up within {wait_us // 1_000_000} s")
    elif heartbeat_ms:
        raise NodeFailed(f"node {node_id}: no heartbeat within {wait_us // 1_000} ms")
    elif known or _number(session, node_id, 0x1000) is not None:
        say(f"node {node_id}: sent; it has no heartbeat that tells its state")
    else:
        raise NodeFailed(
            f"node {node_id}: sent, but nothing answers as node {node_id}: it is not there, or"
            " Stopped without a heartbeat"
        )


def _number(session: NetSession, node_id: int, index: int) -> int | None:
    """Return the value of an object, or None if it cannot be read. A node in Stopped has no SDO."""
    try:
        return int.from_bytes(session.bus.read(node_id, index, 0), "little")
    except SdoAborted:
        return 0
    except SdoFailed:
        return None


def _command_all(session: NetSession, command: NmtCommand, word: str, *, yes: bool) -> None:
    session.confirm(f"NMT {word} to all nodes", yes=yes, risk=nmt_risk(command, None))
    session.work.plan(f"NMT {word} to all nodes")
    session.bus.states.clear()
    session.bus.command(command, ALL_NODES)
    session.work.done()
    session.bus.gather(_LISTEN_US)
    for node_id, state in sorted(session.bus.states.items()):
        say(f"node {node_id}: {boot_slave.state_text(state)}")
    if not session.bus.states:
        say("sent; no node has reported its state since")
    elif command not in RESETS:
        say("sent; other nodes, if there are any, have no heartbeat that tells their state")


# The verb `net boot`: the boot-up of a node after CiA 302-2, step by step.


# Expectations for the boot-up of a node: from a bus.yml, its EDS or DCF, or none.

_HEARTBEAT: Final = (0x1017, 0)
_U16_BYTES: Final = 2
_U32: Final = 0xFFFF_FFFF


def _of_bus_file(path: Path, node_id: int) -> SlaveAssignment:
    """Return the expectations of a bus.yml for a slave.

    Raises:
        Refused: the bus.yml cannot be read, has errors, or does not contain the slave.
    """
    try:
        bus = read_bus_file(path)
        if bus.errors:
            raise ValueError("; ".join(map(str, bus.errors)))
        plan = plan_of(bus)
    except OSError as error:
        refuse_path("--bus", error)
    except (ImportError, ValueError) as error:
        raise Refused(f"--bus {error}") from None
    slaves = {slave.node_id: slave for slave in plan.slaves}
    if node_id not in slaves:
        there = ", ".join(map(str, slaves)) or "none"
        raise Refused(f"--bus {path} has no slave {node_id}; its slaves: {there}")
    return slaves[node_id]


def _of_eds(path: Path, node_id: int) -> SlaveAssignment:
    """Return the expectations of an EDS, which are the device, and for a DCF the configuration.

    Revision and serial number of an EDS are those of one device and are not compared.
    """
    objects = NamedObjects(node_id, read_device_document(path, "--eds").file)
    values = objects.dcf_values()
    power_on = {at: row.power_on_data(node_id) for at, row in objects.rows.items()}

    def number(at: tuple[int, int]) -> int:
        return int.from_bytes(power_on.get(at, b""), "little")

    writable = {at for at, row in objects.rows.items() if row.writable}
    with refusing(f"--eds {path}:"):
        steps = writes(values, number, writable)
    period_ms = int.from_bytes(values.get(_HEARTBEAT, b"")[:_U16_BYTES], "little")
    return SlaveAssignment(
        node_id,
        writes=tuple(ObjectWrite(*at, data) for at, data in steps),
        heartbeat_us=_PERIODS * period_ms * 1_000,
        device_type=number((0x1000, 0)) & _U32,
        vendor_id=number((0x1018, 1)) & _U32,
        product_code=number((0x1018, 2)) & _U32,
    )


def _risk(assignment: SlaveAssignment) -> str:
    """Return the risk of the boot-up, used in the question to the user."""
    resets = not assignment.reset_communication or assignment.restore_sub or assignment.program
    if resets:
        return nmt_risk(NmtCommand.RESET_NODE, assignment.device_type or None)
    objects = NamedObjects(assignment.node_id)
    objects.learn(DEVICE_TYPE, assignment.device_type.to_bytes(4, "little"))
    return write_risk(objects.is_drive, [(write.index, write.sub) for write in assignment.writes])


def _changes(assignment: SlaveAssignment) -> list[str]:
    """Return the changes that the boot-up makes to the node."""
    found = []
    if not assignment.reset_communication:
        found.append("reset communication, unless it is Operational")
    if assignment.program:
        found.append("program download, if its software is another")
    if assignment.restore_sub:
        found.append("restore and reset")
    if assignment.writes:
        found.append(counted(len(assignment.writes), "write"))
    return found


_OnStep = Callable[[boot_slave.BootStep], None]

_HALF: Final = "the node is as the steps before left it"


@click.command()
@click.argument("node", type=NODE_ID)
@click.option(
    "--bus", "bus_file", type=PATH, metavar="FILE", help="bus.yml that describes the node."
)
@node_eds_option("EDS or DCF of the node.")
@click.option(
    "--explain",
    "--dry-run",
    "explain",
    is_flag=True,
    help="Only read: show each step and what would be written.",
)
@click.option("--steps", is_flag=True, help="Boot the node and show each step.")
@click.option(
    "--keep-alive", "leaves_alone", is_flag=True, help="Do nothing to a node that is Operational."
)
@click.option("--start", is_flag=True, help="Start the node after the boot-up.")
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def boot(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    node: int,
    bus_file: Path | None,
    eds: Path | EdsFolder | None,
    explain: bool,
    steps: bool,
    leaves_alone: bool,
    start: bool,
    yes: bool,
) -> None:
    """Boot NODE like an NMT master (CiA 302-2). The exit status is 1 if NODE does not boot.

    The steps are device type, identity, state, software, configuration and error control, in the
    order of Lely's master. The error status is a letter A to O. The expectations come from
    --bus, for the master of that bus.yml, or from --eds, which gives the device, and for a DCF the
    values.

    --explain sends only reads. It shows what the boot-up would write, in order, beside the present
    value of the node. The exit status is 1 if the node would not boot.

    \b
    canmon net can0 boot 5 --explain
    canmon net can0 boot 5 --bus bus.yml --explain --start
    canmon net can0 boot 5 --bus bus.yml --steps --start
    """  # noqa: D301 - click wants the backspace
    if bus_file is not None and eds is not None:
        raise Refused("--bus or --eds: which? give one")
    slave = None if isinstance(eds, EdsFolder) else _expected(node, bus_file, eds)
    with net_session(call, node) as session:
        slave = slave or _expected(node, None, chosen_eds(eds, session.bus, node))
        slave = replace(slave, reset_communication=False) if leaves_alone else slave
        if explain:
            _explain(session, slave, start=start)
            return
        if doing := _changes(slave):
            what = f"boot-up of node {node}: {', '.join(doing)}"
            session.confirm(what, yes=yes, risk=_risk(slave))
        session.work.ending = _HALF
        outcome = session.bus.run(
            node, boot_slave.SlaveBoot(slave, _step_printer(session, shown=steps)).script()
        )
        session.work.ending = ""
        status = outcome.status
        _check_status(node, status)
        letter = f"error status {status.value}: " if status.value else ""
        say(f"node {node}: {letter}{status.text}")
        if start and status is BootStatus.BOOTED:
            may = nmt_risk(NmtCommand.START, slave.device_type or None)
            session.confirm(f"NMT start to node {node}", yes=yes, risk=may)
            session.bus.command(NmtCommand.START, node)
            say(f"node {node}: started")


def _expected(node: int, bus_file: Path | None, eds: Path | None) -> SlaveAssignment:
    if bus_file is not None:
        return _of_bus_file(bus_file, node)
    if eds is not None:
        return _of_eds(eds, node)
    say("no --bus and no --eds: nothing is expected of the node but that it answers")
    return SlaveAssignment(node)


def _step_printer(session: NetSession, *, shown: bool) -> _OnStep:
    """Return a function that prints each step with its time, if steps are shown."""
    began_us = session.bus.now_us

    def show(step: boot_slave.BootStep) -> None:
        if shown:
            click.echo(one_line(f"{format_time(session.bus.now_us - began_us)} {step}"))

    return show


def _check_status(node: int, status: BootStatus) -> None:
    if not status.good:
        raise NodeFailed(f"node {node}: error status {status.value}: {status.text}")


# What `--explain` shows. It sends SDO uploads and nothing else: `SlaveBoot` runs for the identity
# alone, and what it would do afterwards is read back and listed here, in its order. Node guarding
# is not asked either: its first request starts the life guarding of a node (CiA 301).

_NOT_SENT: Final = "not sent"
_NOT_AWAITED: Final = "not waited for"
_COMMUNICATION: Final = 2
"""Sub-index of 1011h for only the communication parameters."""
_MOST_HEX: Final = 8
"""Largest number of bytes that are shown as a number."""


def _explain(session: NetSession, slave: SlaveAssignment, *, start: bool) -> None:
    """Show the boot-up of a node without changing anything.

    Raise NodeFailed if it would not boot.
    """
    node, on_step = slave.node_id, _step_printer(session, shown=True)
    talk = boot_slave.BootTalk(on_step)
    status = session.bus.run(node, _explained(slave, talk, on_step))
    _check_status(node, status)
    if start and status is BootStatus.BOOTED:
        talk.record("NMT start", _NOT_SENT, "would be sent")
    say(f"node {node}: nothing was written")


def _explained(
    slave: SlaveAssignment, talk: boot_slave.BootTalk, on_step: _OnStep
) -> Script[BootStatus]:
    """Read what the boot-up reads.

    Show what it would write. Return the outcome that it would have.
    """
    identity = replace(
        SlaveAssignment(slave.node_id, boots=slave.boots, device_type=slave.device_type),
        vendor_id=slave.vendor_id,
        product_code=slave.product_code,
        revision=slave.revision,
        serial=slave.serial,
    )
    status = (yield from boot_slave.SlaveBoot(identity, on_step).script()).status
    if not status.good:
        return status
    try:
        if slave.boots:
            if not slave.reset_communication and (yield from _explain_state(slave, talk)):
                return BootStatus.WAS_OPERATIONAL
            if slave.software_version and (yield from _explain_software(slave, talk)):
                return BootStatus.BOOTED
            yield from _explain_writes(slave, talk)
    except boot_slave.BootEnded as end:
        return end.status
    if slave.heartbeat_us:
        talk.record("heartbeat", _NOT_AWAITED, f"must come within {slave.heartbeat_us // 1_000} ms")
    elif slave.guard_us:
        talk.record("node guarding", _NOT_SENT, "would start")
    return BootStatus.BOOTED


def _explain_state(slave: SlaveAssignment, talk: boot_slave.BootTalk) -> Script[bool]:
    """Return whether the node is Operational and would not be changed."""
    if slave.heartbeat_us:
        wait_us, status = slave.heartbeat_us, BootStatus.NO_HEARTBEAT
        state = yield from talk.report("state by heartbeat", wait_us, status)
        if state is NmtState.OPERATIONAL:
            return True
        meaning = "would be sent"
    else:
        talk.record("state by guarding", _NOT_SENT, "not known")
        meaning = "would be sent unless it is Operational"
    talk.record("reset communication", _NOT_SENT, meaning)
    return False


def _explain_software(slave: SlaveAssignment, talk: boot_slave.BootTalk) -> Script[bool]:
    """Return whether the node's software would be updated, after which the boot-up restarts."""
    at, name, wanted = boot_slave.IDENTIFICATION, "software identification", slave.software_version
    data = yield from talk.read(at, 1, name, BootStatus.NO_PROGRAM_OBJECTS)
    what = f"{at:04X}h:01 {name}"
    same = int.from_bytes(data, "little") == wanted
    if same or not slave.program or not slave.reset_communication:
        talk.compare(what, data, wanted, BootStatus.UPDATE_NOT_ALLOWED)
        return False
    talk.record(what, f"{int.from_bytes(data, 'little'):08X}h", f"not {wanted:08X}h: to be updated")
    talk.record("1F51h:01 := stop", _NOT_SENT, "would be written unless it is stopped")
    for step in ("1F51h:01 := clear", f"1F50h:01 := {len(slave.program)} bytes"):
        talk.record(step, _NOT_SENT, "would be written")
    talk.record("1F51h:01 := start", _NOT_SENT, "would be written, then booted from the beginning")
    return True


def _explain_writes(slave: SlaveAssignment, talk: boot_slave.BootTalk) -> Script[None]:
    """Show the writes of the configuration, each with the present value of the node."""
    if slave.restore_sub:
        talk.record(f"1011h:{slave.restore_sub:02X} := load", _NOT_SENT, "would be written")
        kind = "communication" if slave.restore_sub == _COMMUNICATION else "node"
        talk.record(f"reset {kind}", _NOT_SENT, "would be sent")
    for write in slave.writes:
        what = f"{write.index:04X}h:{write.sub:02X}"
        data = yield from talk.attempt(write.index, write.sub, what, 1)
        now = f"{data}" if isinstance(data, SdoFailed) else f"{_value_text(data)} now"
        talk.record(f"{what} := {_value_text(write.data)}", now, "would be written")


def _value_text(data: bytes) -> str:
    return f"{data[::-1].hex().upper()}h" if 0 < len(data) <= _MOST_HEX else f"{len(data)} bytes"
