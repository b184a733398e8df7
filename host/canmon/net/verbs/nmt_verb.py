"""The verb `net nmt`: NMT commands, and what comes of them."""

from __future__ import annotations

from typing import Final

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import NetSession, NodeFailed, net_session
from tickrig.host.canmon.risks import nmt_risk
from tickrig.host.canopen.errors import SdoAborted, SdoFailed
from tickrig.host.canopen.master.boot_slave import state_text
from tickrig.host.cli.messages import Refused, say
from tickrig.wire.canopen.nmt import ALL_NODES, NmtCommand, NmtState

_COMMANDS: Final = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "pre-op": NmtCommand.ENTER_PRE_OPERATIONAL,
    "reset-node": NmtCommand.RESET_NODE,
    "reset-comm": NmtCommand.RESET_COMMUNICATION,
}
_AFTER: Final = {
    NmtCommand.START: (NmtState.OPERATIONAL,),
    NmtCommand.STOP: (NmtState.STOPPED,),
    NmtCommand.ENTER_PRE_OPERATIONAL: (NmtState.PRE_OPERATIONAL,),
    NmtCommand.RESET_NODE: (NmtState.INITIALISING,),
    NmtCommand.RESET_COMMUNICATION: (NmtState.INITIALISING,),
}
_RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)
_ALL: Final = "all"

_BOOT_UP_US: Final = 5_000_000
_LISTEN_US: Final = 1_500_000
_PERIODS: Final = 3
"""So many heartbeat periods are waited for a state."""


@click.command()
@click.argument("word", type=click.Choice(list(_COMMANDS)), metavar="COMMAND")
@click.argument("node", metavar="NODE|all")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def command(call: NetCall, word: str, node: str, yes: bool) -> None:
    """Send an NMT command to NODE, or to all: start, stop, pre-op, reset-node, reset-comm.

    Then it is waited for the state, or after a reset for the boot-up; only a node with
    a heartbeat (1017h) tells its state. Exit status 1 if it reports another one, does
    not boot, or nothing of it is heard.

    \b
    canmon net can0 nmt start 5
    canmon net can0 nmt reset-node all --yes
    """  # noqa: D301 - click wants the backspace
    command, node_id = _COMMANDS[word], _node_id(node)
    with net_session(call, node_id or None) as session:
        if node_id == ALL_NODES:
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
    if command in _RESETS:
        wait_us = _BOOT_UP_US
    elif heartbeat_ms:
        wait_us = max(_PERIODS * heartbeat_ms * 1_000, _LISTEN_US)
    state = session.bus.await_state(node_id, wanted, wait_us)
    if state in wanted:
        say(f"node {node_id}: {state_text(wanted[0])}")
    elif state is not None:
        raise NodeFailed(f"node {node_id} is {state_text(state)}, not {state_text(wanted[0])}")
    elif command in _RESETS:
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
    """Return an object, None if the node does not tell it: one that is Stopped has no SDO."""
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
        say(f"node {node_id}: {state_text(state)}")
    if not session.bus.states:
        say("sent; no node has reported its state since")
    elif command not in _RESETS:
        say("sent; other nodes, if there are any, have no heartbeat that tells their state")
