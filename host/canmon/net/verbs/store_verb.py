"""The verbs `net store` and `net restore`: 1010h and 1011h."""

from __future__ import annotations

from typing import Final

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import NetSession, NodeFailed, net_session, of_node
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.options import NODE_ID
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

# Store and restore of a node: 1010h and 1011h.

_STORE: Final = 0x1010
_RESTORE: Final = 0x1011
_PATIENCE_US: Final = 10_000_000
"""A node that writes its memory may answer late."""
_BOOT_UP_US: Final = 5_000_000
_ON_COMMAND: Final = 1
"""Bit 0 of 1010h: it saves on command."""

_AREAS: Final = {"all": 1, "communication": 2, "application": 3}
_COMMUNICATION: Final = 2


def save(session: NetSession, node_id: int, sub: int) -> None:
    """Have a node store parameters; NodeFailed if it cannot.

    Args:
        session: the bus.
        node_id: the node.
        sub: 1 for all, 2 for 1000h to 1FFFh, 3 for 6000h to 9FFFh, others as its maker says.
    """
    with of_node(node_id):
        data = session.bus.read(node_id, _STORE, sub)
        if not data[:1] or not data[0] & _ON_COMMAND:
            raise NodeFailed(
                f"node {node_id}: {_STORE:04X}h:{sub:02X} is {data[::-1].hex().upper()}h:"
                " it does not store on command"
            )
        session.bus.write(node_id, _STORE, sub, b"save", _PATIENCE_US)
    say(f"node {node_id}: stored")


def _load_defaults(session: NetSession, node_id: int, sub: int) -> None:
    """Have a node forget what was stored; it counts from its next reset."""
    with of_node(node_id):
        session.bus.write(node_id, _RESTORE, sub, b"load", _PATIENCE_US)
    say(f"node {node_id}: restored; the defaults count from its next reset")


def reset(session: NetSession, node_id: int, sub: int) -> None:
    """Reset a node, or its communication where only that was restored; wait for its boot-up."""
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
        raise Refused(f"{word!r} is none of {', '.join(_AREAS)}, and no sub-index 1..127")
    return number


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("area", default="all")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def store(call: NetCall, node: int, area: str, yes: bool) -> None:
    """Store parameters of NODE (1010h): all, communication, application or a sub-index.

    \b
    canmon net can0 store 5
    canmon net can0 store 5 communication --yes
    """  # noqa: D301 - click wants the backspace
    sub = _sub(area)
    with net_session(call, node) as session:
        session.confirm(f"node {node} stores its parameters: {area}", yes=yes)
        session.work.plan("store")
        save(session, node, sub)
        session.work.done()


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("area", default="all")
@click.option("--reset", "then_reset", is_flag=True, help="Reset it, so that they count at once.")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def restore(call: NetCall, node: int, area: str, then_reset: bool, yes: bool) -> None:
    """Restore the defaults of NODE (1011h): all, communication, application or a sub-index.

    They count from its next reset.

    \b
    canmon net can0 restore 5 --reset
    canmon net can0 restore 5 communication
    """  # noqa: D301 - click wants the backspace
    sub = _sub(area)
    risk = "Limits and gains of a drive become those of its maker"
    if then_reset:
        risk += "; it lets go of its motor: what hangs on it may fall"
    with net_session(call, node) as session:
        session.confirm(f"node {node} forgets its parameters: {area}", yes=yes, risk=risk)
        session.work.plan("restore", *(["reset"] if then_reset else []))
        _load_defaults(session, node, sub)
        session.work.done()
        if then_reset:
            reset(session, node, sub)
            session.work.done()
