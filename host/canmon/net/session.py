"""One call of a verb of `canmon net`, with its bus, its question to the user, and its end."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

import click

from tickrig.host.canmon.conform.conform_source import ConformSource, open_conform_source
from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.output.listening import until_interrupted
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.host.cli.messages import Refused, SourceFailed, say
from tickrig.host.cli.start import INTERRUPTED
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.page_text import one_line
from tickrig.wire.canopen.sdo_frame import AbortCode, describe_abort

_Title = Callable[[tuple[int, int]], str]
"""Function that returns index, sub-index and name of an object as text."""

_MOST_LISTED: Final = 5

dry_run_option: Final = click.option(
    "--dry-run", is_flag=True, help="Print what would be written, in order; write nothing."
)

_LOCAL: Final = (AbortCode.COMMAND_SPECIFIER, AbortCode.TOGGLE_BIT)


class NodeFailed(click.ClickException):
    """A node refused a request of a `canmon net` command, or did not answer.

    The error ends the command with one line on standard error, and exit status 1.
    """

    exit_code = 1

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class _Work:
    """The planned steps, so that the message of an early end can list the finished ones.

    Attributes:
        ending: final state of the nodes, which is reported in any case, or an empty text if there
            is nothing to report.
    """

    def __init__(self) -> None:
        self.ending = ""
        self._steps: list[str] = []
        self._done = 0

    def plan(self, *steps: str) -> None:
        """Add steps in order."""
        self._steps += steps

    def done(self) -> None:
        """Mark the next step as done."""
        self._done += 1

    def progress(self) -> str:
        """Return a text with the finished and the open steps of the command.

        The text is empty if no steps were planned.
        """
        done, left = self._steps[: self._done], self._steps[self._done :]
        parts = (("done", done), ("not done", left))
        said = [f"{word}: {_listed(items)}" for word, items in parts if items]
        return "; ".join([*said, *filter(None, [self.ending])])


def _listed(steps: list[str]) -> str:
    """List a few steps, or the first and the last of many steps."""
    if len(steps) <= _MOST_LISTED:
        return ", ".join(steps)
    return f"{steps[0]}, ... {steps[-1]} ({len(steps)} in all)"


class NetSession:
    """State of one running `canmon net` command: the open bus and the steps of the command.

    Args:
        source: open bus, with what is known about its nodes.
        timeout_us: time to wait for an answer in microseconds.

    Attributes:
        bus: client that exchanges SDO and NMT messages with the nodes.
        work: planned and finished steps of the command.
    """

    def __init__(self, source: ConformSource, timeout_us: int) -> None:
        self.source, self.timeout_us = source, timeout_us
        self.bus, self.work = NodeBus(source.link, timeout_us), _Work()

    def confirm(self, what: str, *, yes: bool, risk: str = "") -> None:
        """Ask the user before a command changes a node.

        In the virtual time of a rig, the user is not asked.

        Args:
            what: description of the change, which becomes the question.
            yes: whether the option `--yes` was given, which skips the question.
            risk: sentence about the physical risk, or empty for none.

        Raises:
            Refused: the user answered no, or there is no terminal to ask.
        """
        text = one_line(f"{what}. {risk}" if risk else f"{what}.")
        if yes or self.source.virtual:
            if risk:
                say(text)
            return
        if not (sys.stdin.isatty() and sys.stderr.isatty()):
            raise Refused(f"{text.removesuffix('.')}. There is no terminal to ask: give --yes")
        say(text)
        if not click.confirm("Go on?", default=False, err=True):
            raise Refused("not started")


def print_plan(*steps: str) -> None:
    """Print the steps of `--dry-run`, one per line, and that no step was executed."""
    for step in steps:
        click.echo(one_line(f"not done: {step}"))
    say("dry run: nothing was written")


@contextmanager
def net_session(call: NetCall, node_id: int | None = None) -> Iterator[NetSession]:
    """Context manager that opens the bus of a `canmon net` command, and closes it at the end.

    An error ends the command with one line on standard error.

    Args:
        call: options of the command, which name the bus.
        node_id: node-ID of the node. If a rig has several buses, the bus with this node is opened.
            None selects the first bus.

    Raises:
        Refused: the source is not a bus with nodes.
        NodeFailed: a node refused a request, or did not answer.
        SourceFailed: the bus failed.
        Exit: the user interrupted the command.
    """
    source = open_conform_source(call.word, node_id, call.bus)
    session, ended = NetSession(source, call.timeout_us), False
    try:
        with until_interrupted():
            yield session
            ended = True
    except SdoFailed as error:
        raise NodeFailed(_with_work(failure_text(error), session)) from None
    except NodeFailed as error:
        raise NodeFailed(_with_work(error.message, session)) from None
    except LinkClosed as error:
        raise SourceFailed(one_line(_with_work(str(error), session))) from None
    finally:
        source.close()
    if not ended:
        say(one_line(_with_work("interrupted", session)))
        raise click.exceptions.Exit(INTERRUPTED)


def _with_work(text: str, session: NetSession) -> str:
    progress = session.work.progress()
    return f"{text}; {progress}" if progress else text


def failure_text(error: SdoFailed, title: _Title = write_entry) -> str:
    """Return the reason of a failed transfer as text."""
    at = title((error.index, error.sub))
    match error:
        case SdoAborted() if error.code in _LOCAL:
            return f"{at}: aborted: {describe_abort(error.code)}"
        case SdoAborted():
            return f"{at}: refused: {describe_abort(error.code)}"
        case SdoTimeout():
            return f"{at}: no answer within {error.timeout_us // 1_000} ms"
    return str(error)


@contextmanager
def of_node(node_id: int, title: _Title = write_entry) -> Iterator[None]:
    """Context manager that turns SdoFailed into NodeFailed, whose message names node and object."""
    try:
        yield
    except SdoFailed as error:
        text = failure_text(error, title)
        raise NodeFailed(f"node {node_id}: {text}") from None
