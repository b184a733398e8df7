"""The verb `net scan`: which nodes are there."""

from __future__ import annotations

from typing import Final

import click

from tickrig.host.canmon.model.decode.node_board import profile_text
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import net_session
from tickrig.host.canopen.commissioning.node_bus import NetworkScan, NodeFound
from tickrig.host.canopen.master.boot_slave import state_text
from tickrig.host.cli.messages import say, until_unread
from tickrig.host.cli.options import time_option
from tickrig.host.text.page_text import json_text, one_line
from tickrig.host.text.values import counted

_NOBODY: Final = 1
_WAIT_US: Final = 500_000


@click.command()
@time_option("--wait", "wait_us", help="For the last answers, and heartbeats.  [500ms]")
@click.option("--json", "as_json", is_flag=True, help="Nodes as JSON, one a line.")
@click.pass_obj
def command(call: NetCall, wait_us: int | None, as_json: bool) -> None:
    """Say which nodes are there; exit status 1 if none is.

    Each node-ID is asked for its device type (1000h) by SDO; nothing is changed. Who
    is only heard is listed too. A state is known of nodes with a heartbeat.

    \b
    canmon net can0 scan
    canmon net can0 scan --wait 2s --json
    """  # noqa: D301 - click wants the backspace
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
        say("no node answered or was heard")
        raise click.exceptions.Exit(_NOBODY)
    say(counted(len(found), "node"))


def _line(node: NodeFound) -> str:
    state = "" if node.state is None else state_text(node.state)
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
            "state": None if node.state is None else state_text(node.state),
            "answers": node.answers,
        }
    )
