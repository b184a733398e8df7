"""What a person is asked before something on the bus could move, and how far a run is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

import click

from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.errors import until_unread
from tickrig.host.canmon.output.listening import until_interrupted
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.notation import LSS_TO_ALL
from tickrig.host.canopen.conform.verdict import NOTHING_JUDGED, CheckVerdict, Result
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.start import INTERRUPTED, paint
from tickrig.host.links.link import StampedLink
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import counted
from tickrig.wire.can import CanFrame

# Which nodes are on a bus, by what they say: nobody is asked anything.

_LISTEN_US: Final = 1_500_000
"""Longer than most heartbeat periods; a silent node is not heard."""

_FUNCTIONS: Final = (0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)
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
    say(
        f"nobody was heard within {_LISTEN_US / 1e6:.1f} s; who says nothing by itself is not heard"
    )
    return NOTHING_JUDGED


def nodes_heard(link: StampedLink, span_us: int = _LISTEN_US) -> dict[int, int]:
    """Listen; return how many frames were heard of which node-ID.

    Args:
        link: the bus; what is heard is taken from it.
        span_us: for how long, in microseconds.
    """
    heard: dict[int, int] = {}
    until_us = link.now_us + span_us
    while (left_us := until_us - link.now_us) > 0:
        for _, frame in link.receive_stamped(left_us)[1]:
            if (node_id := _node_of(frame)) is not None:
                heard[node_id] = heard.get(node_id, 0) + 1
    return dict(sorted(heard.items()))


def _node_of(frame: CanFrame) -> int | None:
    """Return the node-ID of who sent a frame, as far as its CAN-ID tells; None if it does not."""
    node_id = frame.can_id & 0x7F
    sent = not (frame.extended or frame.remote) and node_id
    return node_id if sent and frame.can_id & 0x780 in _FUNCTIONS else None


def _listed(nodes: dict[int, str] | dict[int, int]) -> str:
    """Write node-IDs for people.

    >>> _listed({3: 1, 16: 2})
    'node 3, node 16'
    """
    return ", ".join(f"node {node_id}" for node_id in nodes)


_Confirm = Callable[[str], bool]

_DOES = {
    Level.READ_ONLY: "is only read",
    Level.COMMUNICATION: (
        "is started, stopped and configured anew, objects below 6000h are written with what they"
        " must refuse; SYNC and PDOs are sent"
    ),
    Level.INTRUSIVE: (
        "is reset, configured anew, stored and restored, objects below 6000h are written;"
        " SYNC, PDOs, LSS are sent"
    ),
}


class Consent:
    """Asks a person, or has their word already.

    Args:
        yes: `--yes`: all was said yes to.
        virtual: all is in a rig in virtual time, where nothing moves.
        alone: no other node is there.
    """

    def __init__(self, *, yes: bool, virtual: bool, alone: bool = False) -> None:
        self._yes, self._virtual, self._alone = yes, virtual, alone

    @property
    def can_ask(self) -> bool:
        """Whether there is somebody to be asked."""
        return sys.stdin.isatty() and sys.stderr.isatty()

    def begin(self, node_id: int, level: Level, others: dict[int, int]) -> None:
        """Say who else is on the bus, and ask before the first frame that changes anything.

        Raises:
            Refused: the answer is no, or nobody is there who could give one.
        """
        if others:
            say(f"also on this bus: {_listed(others)}")
        if level is Level.READ_ONLY or self._yes or self._virtual:
            return
        what = f"node {node_id} {_DOES[level]}: what it drives may move, other nodes may trip"
        if not self.can_ask:
            raise Refused(f"{what}. Nobody is here to be asked: give --yes, or --read-only")
        say(what)
        if not self.confirm("Go on?"):
            raise Refused("not begun")

    def confirm(self, question: str) -> bool:
        """Ask; no where nobody is there.

        In a rig there is nothing to be asked but for LSS, which other nodes would answer too.
        """
        if self._yes:
            return True
        if self._virtual:
            return self._alone or question != LSS_TO_ALL
        if not self.can_ask:
            return False
        return click.confirm(one_line(question), default=False, err=True)


class Progress:
    """A line on a terminal that says how far a run is; none in a pipe.

    Args:
        shown: whether there is a terminal.
    """

    def __init__(self, *, shown: bool) -> None:
        self._shown, self._judged, self._failed = shown, 0, 0

    def begin(self, node_id: int) -> None:
        """Say what lasts before the first result."""
        if self._shown:
            paint(sys.stderr, f"\r\x1b[Knode {node_id} is read")

    def take(self, result: Result) -> None:
        """Count a result."""
        self._judged += 1
        self._failed += result.outcome.verdict is CheckVerdict.FAIL
        if self._shown:
            failed = counted(self._failed, "failure")
            text = f"{counted(self._judged, 'check')}, {failed}: {result.check.id}"
            paint(sys.stderr, f"\r\x1b[K{one_line(text)}")

    def end(self) -> None:
        """Clear the line."""
        if self._shown:
            paint(sys.stderr, "\r\x1b[K")
