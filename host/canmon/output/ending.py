"""How a verb ends: what it says of its source, and its exit status."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

import click

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.cli.start import TERMINATING


class FramesLost(click.ClickException):
    """One line on standard error, and exit status 4."""

    exit_code = 4


def report(source: AnySource[object], strict: bool, more: Iterable[str] = ()) -> None:
    """Say what was lost or no frame, and what else there is to say, then close the source.

    Raises:
        SourceFailed: it ended before its time.
        FramesLost: frames were lost or could not be taken, and the caller is strict.
    """
    source.close()
    for word in (*source.messages(), *more):
        click.echo(word, err=True)
    if source.failed:
        raise SourceFailed(source.failed)
    missing = [f"{source.lost} frames were lost"] if source.lost else []
    missing += [f"{source.unread} lines or frames passed over"] if source.unread else []
    if strict and missing:
        raise FramesLost(", ".join(missing))


@contextmanager
def until_interrupted() -> Iterator[None]:
    """End the block at Ctrl-C, and at the signals that end a program, and go on behind it."""

    def received(number: int, frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt

    before = {number: signal.signal(number, received) for number in TERMINATING}
    try:
        yield
    except KeyboardInterrupt:
        pass
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
