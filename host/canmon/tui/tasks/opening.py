"""Opening the source of a full-screen program: buses to hear and send on, ports, a log, a pipe."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from typing import Final

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.file_source import STDIN, StdinSource
from tickrig.host.canmon.sources.source import open_any, open_live
from tickrig.host.canmon.sources.source_spec import BusSpec, LineSpec, parse_source
from tickrig.host.canmon.tui.tasks.model import Model
from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.cli.can_options import BusOptions

TERMINAL: Final = "/dev/tty"


def open_session(words: Sequence[str], options: BusOptions, model: Model) -> Session:
    """Open what SOURCE words name; nothing is sent until the session is armed.

    Raises:
        Refused: words that name nothing, or things that do not go together.
        SourceFailed: a bus or file that cannot be opened.
    """
    parsed = [parse_source(word) for word in words]
    buses = [word for word in parsed if isinstance(word, BusSpec)]
    lines = [word for word in parsed if isinstance(word, LineSpec)]
    if parsed == [None]:
        return Session(StdinSource(_take_pipe()), model)
    if len(buses) + len(lines) < len(parsed) or not (words or options):
        return Session(open_any(words, options), model)
    if not lines:
        buses = buses or [BusSpec()]
    from tickrig.host.canmon.output.transmitter import send_on  # noqa: PLC0415 - python-can is slow

    source, opened = open_live(buses, lines, options)
    return Session(
        source, model, {name: partial(send_on, bus, name) for name, bus in opened.items()}
    )


def _take_pipe() -> int:
    """Let the keys come from the terminal; return where the pipe is now."""
    try:
        terminal = os.open(TERMINAL, os.O_RDWR)
    except OSError as error:
        raise SourceFailed(f"{TERMINAL}: {error.strerror}") from error
    pipe = os.dup(STDIN)
    os.dup2(terminal, STDIN)
    os.close(terminal)
    return pipe
