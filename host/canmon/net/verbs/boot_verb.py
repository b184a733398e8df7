"""The verb `net boot`: the boot-up of a node after CiA 302-2, step by step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.net.boot_plan import changes, nothing_expected, of_bus_file, of_eds, risk
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import NetSession, NodeFailed, net_session
from tickrig.host.canmon.risks import nmt_risk
from tickrig.host.canopen.master.assignment import SlaveAssignment
from tickrig.host.canopen.master.boot_slave import BootOutcome, SlaveBoot
from tickrig.host.canopen.master.boot_status import BootStatus
from tickrig.host.canopen.master.boot_talk import BootStep
from tickrig.host.cli.messages import say
from tickrig.host.cli.options import NODE_ID, PATH
from tickrig.host.cli.refused import Refused
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import format_time
from tickrig.wire.canopen.nmt import NmtCommand

HALF: Final = "the node is as the steps before left it"


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
        if doing := changes(slave):
            what = f"boot-up of node {node}: {', '.join(doing)}"
            session.confirm(what, yes=yes, risk=risk(slave))
        session.work.ending = HALF
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
        return of_bus_file(bus_file, node)
    return nothing_expected(node) if eds is None else of_eds(eds, node)


def _boot(session: NetSession, slave: SlaveAssignment, *, explain: bool) -> BootOutcome:
    began_us = session.bus.now_us

    def show(step: BootStep) -> None:
        if explain:
            click.echo(one_line(f"{format_time(session.bus.now_us - began_us)} {step}"))

    return session.bus.run(slave.node_id, SlaveBoot(slave, show).script())
