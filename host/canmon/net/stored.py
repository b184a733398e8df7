"""Store and restore of a node: 1010h and 1011h."""

from __future__ import annotations

from typing import Final

from tickrig.host.canmon.net.session import NetSession, NodeFailed, of_node
from tickrig.host.cli.messages import say
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

STORE: Final = 0x1010
RESTORE: Final = 0x1011
PATIENCE_US: Final = 10_000_000
"""A node that writes its memory may answer late."""
BOOT_UP_US: Final = 5_000_000
ON_COMMAND: Final = 1
"""Bit 0 of 1010h: it saves on command."""

AREAS: Final = {"all": 1, "communication": 2, "application": 3}
COMMUNICATION: Final = 2


def save(session: NetSession, node_id: int, sub: int) -> None:
    """Have a node store parameters; NodeFailed if it cannot.

    Args:
        session: the bus.
        node_id: the node.
        sub: 1 for all, 2 for 1000h to 1FFFh, 3 for 6000h to 9FFFh, others as its maker says.
    """
    with of_node(node_id):
        data = session.bus.read(node_id, STORE, sub)
        if not data[:1] or not data[0] & ON_COMMAND:
            raise NodeFailed(
                f"node {node_id}: {STORE:04X}h:{sub:02X} is {data[::-1].hex().upper()}h:"
                " it does not store on command"
            )
        session.bus.write(node_id, STORE, sub, b"save", PATIENCE_US)
    say(f"node {node_id}: stored")


def load_defaults(session: NetSession, node_id: int, sub: int) -> None:
    """Have a node forget what was stored; it counts from its next reset."""
    with of_node(node_id):
        session.bus.write(node_id, RESTORE, sub, b"load", PATIENCE_US)
    say(f"node {node_id}: restored; the defaults count from its next reset")


def reset(session: NetSession, node_id: int, sub: int) -> None:
    """Reset a node, or its communication where only that was restored; wait for its boot-up."""
    communication = sub == COMMUNICATION
    command = NmtCommand.RESET_COMMUNICATION if communication else NmtCommand.RESET_NODE
    session.bus.command(command, node_id)
    wanted = (NmtState.INITIALISING,)
    if session.bus.await_state(node_id, wanted, BOOT_UP_US) not in wanted:
        raise NodeFailed(f"node {node_id}: no boot-up within {BOOT_UP_US // 1_000_000} s")
    say(f"node {node_id}: boot-up")
