"""One call of a verb of `canmon net`: its bus, what is asked, and how it ends."""

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
"""Writes index, sub-index and name of an object."""

_MOST_LISTED: Final = 5

_LOCAL: Final = (AbortCode.COMMAND_SPECIFIER, AbortCode.TOGGLE_BIT)


class NodeFailed(click.ClickException):
    """A node refused, or did not answer: one line on standard error, and exit status 1."""

    exit_code = 1

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class _Work:
    """What is to be done, step by step, so that an end in the middle can say how far it came.

    Attributes:
        ending: how the nodes are left, however it ends; empty if there is nothing to be said.
    """

    def __init__(self) -> None:
        self.ending = ""
        self._steps: list[str] = []
        self._done = 0

    def plan(self, *steps: str) -> None:
        """Add steps, in their order."""
        self._steps += steps

    def done(self) -> None:
        """Note that the next step is done."""
        self._done += 1

    def progress(self) -> str:
        """Say what was done and what was not; empty where nothing was planned."""
        done, left = self._steps[: self._done], self._steps[self._done :]
        parts = (("done", done), ("not done", left))
        said = [f"{word}: {_listed(items)}" for word, items in parts if items]
        return "; ".join([*said, *filter(None, [self.ending])])


def _listed(steps: list[str]) -> str:
    """List a few steps; of many the first and the last one."""
    if len(steps) <= _MOST_LISTED:
        return ", ".join(steps)
    return f"{steps[0]}, ... {steps[-1]} ({len(steps)} in all)"


class NetSession:
    """An open bus.

    Args:
        source: the bus, and what is known of its nodes.
        timeout_us: how long an answer is waited for.

    Attributes:
        bus: speaks with its nodes.
        work: what is to be done.
    """

    def __init__(self, source: ConformSource, timeout_us: int) -> None:
        self.source, self.timeout_us = source, timeout_us
        self.bus, self.work = NodeBus(source.link, timeout_us), _Work()

    def confirm(self, what: str, *, yes: bool, risk: str = "") -> None:
        """Ask before something is changed; in a rig in virtual time nobody is.

        Args:
            what: is done.
            yes: `--yes`: it was said yes to.
            risk: what it may do in the world, as a sentence; empty for nothing.

        Raises:
            Refused: the answer is no, or nobody is there who could give one.
        """
        text = one_line(f"{what}. {risk}" if risk else f"{what}.")
        if yes or self.source.virtual:
            if risk:
                say(text)
            return
        if not (sys.stdin.isatty() and sys.stderr.isatty()):
            raise Refused(f"{text.removesuffix('.')}. Nobody is here to be asked: give --yes")
        say(text)
        if not click.confirm("Go on?", default=False, err=True):
            raise Refused("not begun")


@contextmanager
def net_session(call: NetCall, node_id: int | None = None) -> Iterator[NetSession]:
    """Open the bus, and give it back; what goes wrong ends the verb with a line.

    Args:
        call: what the command line says of the bus.
        node_id: of the node, which says the bus of a rig that has several; None for the first.

    Raises:
        Refused: it is nothing that can be asked anything.
        NodeFailed: a node refused or did not answer.
        SourceFailed: the bus failed.
        Exit: it was interrupted.
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
    """Say why a transfer failed, in words."""
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
    """Name the node, and the object, in what goes wrong in the block; NodeFailed then."""
    try:
        yield
    except SdoFailed as error:
        text = failure_text(error, title)
        raise NodeFailed(f"node {node_id}: {text}") from None
