"""The verb `net boot`: the boot-up of a node after CiA 302-2, step by step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.eds_document import read_device_document
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.node_objects import DEVICE_TYPE, NamedObjects
from tickrig.host.canmon.net.session import NetSession, NodeFailed, net_session
from tickrig.host.canmon.risks import nmt_risk, write_risk
from tickrig.host.canopen.bus_file.bus_file import read_bus_file
from tickrig.host.canopen.commissioning.configuration import dcf_values, writes
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.boot_slave import BootOutcome, BootStatus, BootStep, SlaveBoot
from tickrig.host.canopen.master.from_bus_file import plan_of
from tickrig.host.cli.messages import Refused, refuse_path, refusing, say
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import counted, format_time
from tickrig.wire.canopen.nmt import NmtCommand

# What is expected of a node at its boot-up: by a bus.yml, by its EDS or DCF, or nothing.

_HEARTBEAT: Final = (0x1017, 0)
_U16_BYTES: Final = 2
_U32: Final = 0xFFFF_FFFF
_PERIODS: Final = 3
"""So many periods of its heartbeat are waited for it."""


def _of_bus_file(path: Path, node_id: int) -> SlaveAssignment:
    """Return what a bus.yml expects of a slave.

    Raises:
        Refused: it cannot be read, is wrong, or has no such slave.
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
    """Return what an EDS expects: the device, and of a DCF its configuration; Refused if none.

    Revision and serial number of an EDS are those of one device: any will do.
    """
    objects = NamedObjects(node_id, read_device_document(path, "--eds").file)
    file, device = objects.file, objects.device
    assert file is not None
    assert device is not None
    values = dcf_values(file, device, node_id)
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
    """Say what the boot-up may move."""
    resets = not assignment.reset_communication or assignment.restore_sub or assignment.program
    if resets:
        return nmt_risk(NmtCommand.RESET_NODE, assignment.device_type or None)
    objects = NamedObjects(assignment.node_id)
    objects.learn(DEVICE_TYPE, assignment.device_type.to_bytes(4, "little"))
    return write_risk(objects.is_drive, [(write.index, write.sub) for write in assignment.writes])


def _changes(assignment: SlaveAssignment) -> list[str]:
    """Say what the boot-up does to the node, beside reading."""
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


def _nothing_expected(node_id: int) -> SlaveAssignment:
    """Return what is expected where nobody says anything: that it answers."""
    say("no --bus and no --eds: nothing is expected of the node but that it answers")
    return SlaveAssignment(node_id)


_HALF: Final = "the node is as the steps before left it"


@click.command()
@click.argument("node", type=NODE_ID)
@click.option("--bus", "bus_file", type=PATH, metavar="FILE", help="bus.yml that has the node.")
@click.option("--eds", type=PATH, metavar="FILE", help="EDS or DCF of the node.")
@click.option("--explain", is_flag=True, help="Show each step: asked, answered, what follows.")
@click.option("--keep-alive", "leaves_alone", is_flag=True, help="Leave it if it is Operational.")
@click.option("--start", is_flag=True, help="Start it when it has booted.")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def command(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    node: int,
    bus_file: Path | None,
    eds: Path | None,
    explain: bool,
    leaves_alone: bool,
    start: bool,
    yes: bool,
) -> None:
    """Boot NODE as an NMT master does (CiA 302-2); exit status 1 if it does not boot.

    Device type, identity, state, software, configuration, error control, in the order
    of Lely's master; the error status is a letter A to O. What is expected says --bus,
    as the master of that bus.yml has it, or --eds: its device, and of a DCF its values.

    \b
    canmon net can0 boot 5 --explain
    canmon net can0 boot 5 --bus bus.yml --explain --start
    """  # noqa: D301 - click wants the backspace
    if bus_file is not None and eds is not None:
        raise Refused("--bus or --eds: which? give one")
    slave = _expected(node, bus_file, eds)
    slave = replace(slave, reset_communication=False) if leaves_alone else slave
    with net_session(call, node) as session:
        if doing := _changes(slave):
            what = f"boot-up of node {node}: {', '.join(doing)}"
            session.confirm(what, yes=yes, risk=_risk(slave))
        session.work.ending = _HALF
        outcome = _boot(session, slave, explain=explain)
        session.work.ending = ""
        status = outcome.status
        if not status.good:
            raise NodeFailed(f"node {node}: error status {status.value}: {status.text}")
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
    return _nothing_expected(node) if eds is None else _of_eds(eds, node)


def _boot(session: NetSession, slave: SlaveAssignment, *, explain: bool) -> BootOutcome:
    began_us = session.bus.now_us

    def show(step: BootStep) -> None:
        if explain:
            click.echo(one_line(f"{format_time(session.bus.now_us - began_us)} {step}"))

    return session.bus.run(slave.node_id, SlaveBoot(slave, show).script())
