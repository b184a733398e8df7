"""Opening the source of a full-screen program: buses to hear and send on, a log, or a pipe."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from typing import Final

from tickrig.host.canmon.failure import SourceFailed
from tickrig.host.canmon.source import Source, open_source
from tickrig.host.canmon.source_word import BusWord, parse_source
from tickrig.host.canmon.stdin_source import STDIN, StdinSource
from tickrig.host.canmon.tui.model import Model
from tickrig.host.canmon.tui.session import Send, Session
from tickrig.host.cli.can_options import BusOptions

TERMINAL: Final = "/dev/tty"


def open_session(words: Sequence[str], options: BusOptions, model: Model) -> Session:
    """Open what SOURCE words name; nothing is sent until the session is armed.

    Raises:
        Refused: words that name nothing, or things that do not go together.
        SourceFailed: a bus or file that cannot be opened.
    """
    parsed = [parse_source(word) for word in words]
    buses = [word for word in parsed if isinstance(word, BusWord)]
    if parsed == [None]:
        return Session(StdinSource(_take_pipe()), model)
    if len(buses) < len(parsed) or not (words or options):
        return Session(open_source(words, options), model)
    return Session(*_open_buses(buses or [BusWord()], options, model))


def _open_buses(
    words: Sequence[BusWord], options: BusOptions, model: Model
) -> tuple[Source, Model, dict[str, Send]]:
    from tickrig.host.canmon.bus_reader import open_bus  # noqa: PLC0415 - python-can is slow
    from tickrig.host.canmon.bus_source import BusSource, merged, reader_of  # noqa: PLC0415
    from tickrig.host.canmon.transmitter import send_on  # noqa: PLC0415

    sends: dict[str, Send] = {}
    readers = []
    try:
        for word in words:
            bus, interface, name = open_bus(merged(word, options))
            readers.append(reader_of(bus, interface, name))
            sends[name] = partial(send_on, bus, name)
    except BaseException:
        for reader in readers:
            reader.close()
        raise
    return BusSource(readers, [word.chosen for word in words]), model, sends


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
