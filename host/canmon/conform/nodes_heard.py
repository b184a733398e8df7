"""Which nodes are on a bus, by what they say: nobody is asked anything."""

from __future__ import annotations

from typing import Final

import click

from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.errors import until_unread
from tickrig.host.canmon.output.listening import until_interrupted
from tickrig.host.canopen.conform.verdict import NOTHING_JUDGED
from tickrig.host.cli.messages import say
from tickrig.host.cli.start import INTERRUPTED
from tickrig.host.links.link import StampedLink
from tickrig.host.text.values import counted
from tickrig.wire.can import CanFrame

LISTEN_US: Final = 1_500_000
"""Longer than most heartbeat periods; a silent node is not heard."""

FUNCTIONS: Final = (0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)
"""What slaves send, in the pre-defined connection set (CiA 301 v4.2, 7.3.5)."""


def list_nodes(source: ConformSource) -> int:
    """List the nodes that are on a bus, for who did not name one; return the exit status."""
    lines = [f"node {node_id}  {name}" for node_id, name in source.nodes.items()]
    ended = source.virtual
    with until_interrupted():
        if not ended:
            heard = nodes_heard(source.link)
            lines = [f"node {each}  {counted(frames, 'frame')}" for each, frames in heard.items()]
            ended = True
    with until_unread():
        for line in lines:
            click.echo(line)
    if lines or not ended:
        return 0 if lines else INTERRUPTED
    say(f"nobody was heard within {LISTEN_US / 1e6:.1f} s; who says nothing by itself is not heard")
    return NOTHING_JUDGED


def nodes_heard(link: StampedLink, span_us: int = LISTEN_US) -> dict[int, int]:
    """Listen; return how many frames were heard of which node-ID.

    Args:
        link: the bus; what is heard is taken from it.
        span_us: for how long, in microseconds.
    """
    heard: dict[int, int] = {}
    until_us = link.now_us + span_us
    while (left_us := until_us - link.now_us) > 0:
        for _, frame in link.receive_stamped(left_us)[1]:
            if (node_id := node_of(frame)) is not None:
                heard[node_id] = heard.get(node_id, 0) + 1
    return dict(sorted(heard.items()))


def node_of(frame: CanFrame) -> int | None:
    """Return the node-ID of who sent a frame, as far as its CAN-ID tells; None if it does not."""
    node_id = frame.can_id & 0x7F
    sent = not (frame.extended or frame.remote) and node_id
    return node_id if sent and frame.can_id & 0x780 in FUNCTIONS else None


def listed(nodes: dict[int, str] | dict[int, int]) -> str:
    """Write node-IDs for people.

    >>> listed({3: 1, 16: 2})
    'node 3, node 16'
    """
    return ", ".join(f"node {node_id}" for node_id in nodes)
