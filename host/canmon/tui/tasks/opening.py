"""Opening the source of a full-screen program: buses to hear and send on, ports, a log, a pipe."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from typing import Final

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.file_source import STDIN, StdinSource
from tickrig.host.canmon.sources.live_source import LiveSource, Reader
from tickrig.host.canmon.sources.source import open_any
from tickrig.host.canmon.sources.source_spec import BusSpec, LineSpec, parse_source
from tickrig.host.canmon.tui.tasks.model import Model
from tickrig.host.canmon.tui.tasks.session import Send, Session
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.monitor.frames.record import AnyRecord

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
    return Session(*_open_live(buses, lines, options, model))


def _open_live(
    buses: Sequence[BusSpec], lines: Sequence[LineSpec], options: BusOptions, model: Model
) -> tuple[LiveSource[AnyRecord], Model, dict[str, Send]]:
    from tickrig.host.canmon.output.transmitter import send_on  # noqa: PLC0415
    from tickrig.host.canmon.sources.bus_source import (  # noqa: PLC0415
        merged,
        open_bus,
        reader_of,
    )
    from tickrig.host.canmon.sources.line_source import open_port  # noqa: PLC0415 - pyserial

    sends: dict[str, Send] = {}
    readers: list[Reader[AnyRecord]] = []
    try:
        for word in buses:
            bus, interface, name = open_bus(merged(word, options))
            readers.append(reader_of(bus, interface, name))
            sends[name] = partial(send_on, bus, name)
        for line in lines:
            readers.append(open_port(line))
    except BaseException:
        for reader in readers:
            reader.close()
        raise
    chosen = [*(word.chosen for word in buses), *(None for _ in lines)]
    return LiveSource(readers, chosen), model, sends


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
