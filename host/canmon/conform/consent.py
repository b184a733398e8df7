"""What a person is asked before something on the bus could move, and how far a run is."""

from __future__ import annotations

import sys
from collections.abc import Callable

import click

from tickrig.host.canmon.conform.nodes_heard import listed
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.notation.bound_check import LSS_TO_ALL
from tickrig.host.canopen.conform.verdict import Result, Verdict
from tickrig.host.cli.messages import say
from tickrig.host.cli.refused import Refused
from tickrig.host.cli.start import paint
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import counted

Confirm = Callable[[str], bool]

DOES = {
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
            say(f"also on this bus: {listed(others)}")
        if level is Level.READ_ONLY or self._yes or self._virtual:
            return
        what = f"node {node_id} {DOES[level]}: what it drives may move, other nodes may trip"
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
        self._failed += result.outcome.verdict is Verdict.FAIL
        if self._shown:
            failed = counted(self._failed, "failure")
            text = f"{counted(self._judged, 'check')}, {failed}: {result.check.id}"
            paint(sys.stderr, f"\r\x1b[K{one_line(text)}")

    def end(self) -> None:
        """Clear the line."""
        if self._shown:
            paint(sys.stderr, "\r\x1b[K")
