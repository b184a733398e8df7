"""Opening what SOURCE words name: buses, serial ports, log files or standard input."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, cast

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.file_source import FileSource, StdinSource
from tickrig.host.canmon.sources.source import (
    AnySource,
    BusSpec,
    FileSpec,
    LineSpec,
    Source,
    parse_source,
)
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused
from tickrig.host.links.link import LinkClosed

if TYPE_CHECKING:
    from tickrig.host.canmon.model.frames import AnyRecord
    from tickrig.host.canmon.sources.bus_source import OpenBus
    from tickrig.host.canmon.sources.live_source import LiveSource, Reader


def open_source(words: Sequence[str], options: BusOptions | None = None) -> Source:
    """Open what SOURCE words name: one or more buses, or files, or standard input.

    Files are merged by time; buses are read as frames come in.

    Args:
        words: SOURCE words; without any the options name a bus.
        options: interface, bit rate and such of the buses.

    Raises:
        Refused: words that name nothing, or things that do not go together.
        SourceFailed: a bus or file that cannot be opened.
    """
    options = options or BusOptions()
    if not words and not options:
        raise Refused(
            "no SOURCE: name a bus as can0, a log file as run.log, or - for standard input"
        )
    parsed = [parse_source(word) for word in words]
    files = [word for word in parsed if isinstance(word, FileSpec)]
    buses = [word for word in parsed if isinstance(word, BusSpec)]
    if parsed == [None]:
        return StdinSource()
    if len(files) == len(parsed) > 0:
        return FileSource(files)
    if any(isinstance(word, LineSpec) for word in parsed):
        raise Refused("serial lines are shown by dump, top and tui: " + " ".join(words))
    if len(buses) < len(parsed):
        raise Refused("buses, files and standard input cannot be mixed: " + " ".join(words))
    return cast("Source", open_live(buses or [BusSpec()], [], options)[0])  # buses alone: frames


def open_any(words: Sequence[str], options: BusOptions) -> AnySource[AnyRecord]:
    """Open what SOURCE words name, as `open_source` does; serial ports and buses may be mixed."""
    parsed = [parse_source(word) for word in words]
    lines = [word for word in parsed if isinstance(word, LineSpec)]
    if not lines:
        return open_source(words, options)
    buses = [word for word in parsed if isinstance(word, BusSpec)]
    if len(buses) + len(lines) < len(parsed):
        raise Refused("serial ports, files and standard input cannot be mixed: " + " ".join(words))
    return open_live(buses, lines, options)[0]


def open_live(
    buses: Sequence[BusSpec], lines: Sequence[LineSpec], options: BusOptions
) -> tuple[LiveSource[AnyRecord], dict[str, OpenBus]]:
    """Open buses and serial ports, so that they can be opened again.

    Returns:
        The source, and the buses by name, to send on.

    Raises:
        Refused: options that python-can does not know.
        SourceFailed: a bus or port that cannot be opened.
    """
    from tickrig.host.canmon.sources.live_source import LiveSource  # noqa: PLC0415 - threads
    from tickrig.host.canmon.sources.reopening_reader import ReopeningReader  # noqa: PLC0415

    opened: dict[str, OpenBus] = {}
    readers: list[Reader[AnyRecord]] = []
    try:
        for word in buses:
            from tickrig.host.canmon.sources import bus_source  # noqa: PLC0415 - python-can is slow

            bus = bus_source.OpenBus(word, options)
            opened[bus.name] = bus
            reader: Reader[AnyRecord] = bus.reader
            readers.append(reader if reader.stepped else ReopeningReader(reader, bus.open_again))
        for line in lines:
            from tickrig.host.canmon.sources.line_source import LineReader  # noqa: PLC0415 - pyserial

            reader = LineReader(line)
            readers.append(ReopeningReader(reader, partial(LineReader, line)))
    except BaseException as error:
        for reader in readers:
            reader.close()
        if isinstance(error, LinkClosed):
            raise SourceFailed(str(error)) from None
        raise
    return LiveSource(readers, [*(bus.chosen for bus in buses), *(None for _ in lines)]), opened


def log_path(word: str) -> Path:
    """Return the log file that a word names; Refused if it names none."""
    parsed = parse_source(word)
    if not isinstance(parsed, FileSpec):
        raise Refused(f"{word!r} is no log file")
    return parsed.path
