"""Sources of frames with a common interface, and the meaning of SOURCE words.

Examples of SOURCE words:

>>> parse_source("slcan:/dev/ttyACM0@500k")
BusSpec(interface='slcan', channel='/dev/ttyACM0', bitrate=500000, chosen=None, data_bitrate=None)
>>> parse_source("can0,123:7FF").chosen.passes(0x123)
True
>>> parse_source("serial:/dev/ttyUSB0@57600,rtc-lite").protocol
'rtc-lite'
>>> parse_source("-") is None
True
"""

from __future__ import annotations

import heapq
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from itertools import islice, takewhile
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Generic, TypeVar, cast

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import CandumpFilter, LogTime, Record, date_text, flagged_id
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_reader import Item, LogLines, among, read_log
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed, refusing
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import ready

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_reader
    from tickrig.host.canmon.model.columns import columns as column_blocks
    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.frames import AnyRecord
    from tickrig.host.canmon.sources import bus_source, line_source, live_source
else:  # numpy, threads, python-can, pyserial: imported for what wants them
    column_reader = LazyModule("tickrig.host.canmon.model.columns.column_reader")
    column_blocks = LazyModule("tickrig.host.canmon.model.columns.columns")
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")
    line_source = LazyModule("tickrig.host.canmon.sources.line_source")
    live_source = LazyModule("tickrig.host.canmon.sources.live_source")


# Sources of frames with one interface: buses, log files or standard input.

_Taken_co = TypeVar("_Taken_co", covariant=True)


class AnySource(Generic[_Taken_co]):
    """A source from which a command reads frames, or messages of a serial line, with `poll`.

    Attributes:
        live: whether frames arrive as time passes, as from a bus. False means that all frames exist
            already, as in a log.
        failed: reason why the source ended early, empty for none.
        marks: events after the frames that the last `poll` returned.
        recorded: whether the source is a log. The marks in a log were already reported when it was
            recorded.
        buses: open buses of the source by name, on which frames can be sent.
    """

    live = recorded = False
    failed = ""
    marks: Sequence[log_file.Mark] = ()
    buses: Mapping[str, bus_source.OpenBus] = MappingProxyType({})
    _ended = False
    _cut: _CutLog | None = None

    @property
    def ended(self) -> bool:
        """Whether no more items will arrive."""
        return self._ended

    @property
    def away(self) -> Sequence[str]:
        """Buses that went away and are not back."""
        return ()

    @property
    def gaps(self) -> int:
        """Number of times that a bus went away and had to be opened again."""
        return 0

    def reopen(self) -> None:
        """Open buses that go away again. A source with an end is not affected."""

    def tallies(self) -> Iterable[tuple[str, log_file.LogTally]]:
        """Return the name of each bus or file, with its counts of items not read as frames."""
        return ()

    @property
    def lost(self) -> int:
        """Number of frames that were lost before they were read, if the bus or log reports this."""
        return sum(tally.lost for _, tally in self.tallies())

    @property
    def unread(self) -> int:
        """Number of lines and frames that arrived but were not read, such as CAN XL frames."""
        return sum(tally.unread for _, tally in self.tallies())

    def poll(self, timeout_us: int, /) -> Sequence[_Taken_co]:
        """Wait for a first frame. Return all frames that have arrived, or none."""
        return []

    def messages(self) -> list[str]:
        """Report invalid and lost frames, and an empty part, with one line per message."""
        said = [text for name, tally in self.tallies() for text in tally.messages(name)]
        return said + (self._cut.messages() if self._cut else [])

    def losses(self) -> list[str]:
        """Report lost and unreadable frames, but not items of other types."""
        return [text for name, tally in self.tallies() for text in tally.losses(name)]

    def errors(self) -> list[str]:
        """Report bus errors that are not error frames."""
        return [text for name, tally in self.tallies() for text in tally.errors(name)]

    @property
    def nothing_passed(self) -> bool:
        """Whether the source has frames, but none was selected.

        The SOURCE words may have filters that select frames. In a log, only the frames of the
        wanted part are selected.
        """
        return self._cut is not None and self._cut.empty

    @property
    def without_errors(self) -> str:
        """Reason why the source cannot contain error frames, empty if it can."""
        told = [tally.without_errors for _, tally in self.tallies()]
        return told[0] if told and all(told) else ""

    def close(self) -> None:
        """Release the resources. You may close a source twice."""
        self._ended = True


Source = AnySource[Record]


INTERFACES: Final = {"udp": "udp_multicast", "sim": "tickrig"}
"""Short names of python-can's interfaces."""

_PROTOCOLS: Final = ("rrc", "rtc-lite", "rtc-lite-xor8")
"""Protocols of serial lines."""

_UDP_GROUP: Final = "239.74.163.2"
"""IPv4 group of python-can's udp_multicast."""

_BUS: Final = re.compile(
    r"(?:(?P<interface>[A-Za-z]\w*):)?(?P<channel>[^@]*)"
    r"(?:@(?P<bitrate>[0-9]{1,9}[kM]?)(?:/(?P<fast>[0-9]{1,9}[kM]?))?)?"
)
_LINE: Final = re.compile(
    r"serial:(?P<port>.+?)(?:@(?P<baud>[0-9]{1,9}[kM]?))?"
    rf",(?P<protocol>{'|'.join(_PROTOCOLS)})(?P<host>,host)?"
)
_FACTORS: Final = {"k": 1_000, "M": 1_000_000}


@dataclass(frozen=True, slots=True)
class FileSpec:
    """A log file, with a filter for its frames."""

    path: Path
    chosen: CandumpFilter | None = None


@dataclass(frozen=True, slots=True)
class BusSpec:
    """Result of parsing a SOURCE word for a CAN bus, with a filter for the frames of the bus.

    If an attribute is None, the options of the command give the value. A bus with a data bit rate
    is a CAN FD bus.

    Attributes:
        prefix: text before the first colon of the word, such as `slcan` in `slcan:/dev/ttyACM0`.
            Without the option `-i`, this text names the interface. If `-i` names another interface,
            this text is the beginning of the channel instead.
    """

    interface: str | None = None
    channel: str | None = None
    bitrate: int | None = None
    chosen: CandumpFilter | None = None
    data_bitrate: int | None = None
    prefix: str = field(default="", repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class LineSpec:
    """Result of parsing a SOURCE word for a serial port, with the protocol of the serial line.

    Attributes:
        port: device name or pyserial URL of the port.
        baud: baud rate in bit/s, or None for the default of the protocol.
        protocol: protocol of the line, one of `_PROTOCOLS`.
        from_host: whether the port receives what the host sends. Otherwise, it receives what the
            device sends.
    """

    port: str
    baud: int | None
    protocol: str
    from_host: bool = False


def parse_source(word: str) -> FileSpec | BusSpec | LineSpec | None:
    """Parse a SOURCE word of the command line: a log file, a CAN bus, or a serial port.

    The result is None for `-`, which means standard input.

    Raises:
        Refused: the word has none of these forms.
    """
    if word == "-":
        return None
    if line := _LINE.fullmatch(word):
        baud = _bit_s(line["baud"]) if line["baud"] else None
        return LineSpec(line["port"], baud, line["protocol"], bool(line["host"]))
    if Path(word).is_file():
        return _file(word, "")
    name, _, filters = word.partition(",")
    path = Path(name)
    if path.is_file() or path.suffix.lower() in (*log_file.SUFFIXES, log_file.COMPRESSED):
        return _file(name, filters)
    if name and path.is_dir():
        raise Refused(f"SOURCE {name!r} is a folder")
    return _bus(name, filters)


def _file(name: str, filters: str) -> FileSpec:
    with refusing("", log_file.LogFormatError):
        log_file.log_format(Path(name))
    return FileSpec(Path(name), _chosen(filters))


def _bus(name: str, filters: str) -> BusSpec:
    match = _BUS.fullmatch(name)
    if match is None or not name:
        raise Refused(f"SOURCE {name!r} is not a bus as can0 or slcan:/dev/ttyACM0@500k, nor a log")
    interface, channel, bitrate, fast = match.group("interface", "channel", "bitrate", "fast")
    prefix = interface or ""
    if name in INTERFACES:
        interface, channel = name, ""
    if interface == "udp":
        channel = channel or _UDP_GROUP
    return BusSpec(
        INTERFACES.get(interface, interface),
        channel or None,
        _bit_s(bitrate) if bitrate else None,
        _chosen(filters),
        _bit_s(fast) if fast else None,
        prefix,
    )


def _bit_s(text: str) -> int:
    factor = _FACTORS.get(text[-1], 1)
    return int(text.rstrip("kM")) * factor


def _chosen(filters: str) -> CandumpFilter | None:
    with refusing():
        return CandumpFilter.parse(filters) if filters else None


# A part of a log, cut out by times.


@dataclass(frozen=True, slots=True)
class LogCut:
    """The part of a log that a command reads, as the options `--from` and `--to` select it.

    By default, the part is the whole log.

    Attributes:
        begin: first moment of the part, or None for the beginning of the log.
        end: last moment of the part, or None for the end of the log.
        earlier: function that is called with each frame before the part, so that a decoder can
            learn from it.
    """

    begin: LogTime | None = None
    end: LogTime | None = None
    earlier: Callable[[Record], object] | None = None

    def __bool__(self) -> bool:
        """Return whether a frame may be left out."""
        return self.begin is not None or self.end is not None

    def __str__(self) -> str:
        """Return the cut in the notation of its options."""
        return " ".join(
            f"--{name} {time.text}"
            for name, time in (("from", self.begin), ("to", self.end))
            if time is not None
        )


class _CutLog:
    """The wanted part of a log that is read.

    Time may go back. Each frame is compared with the limits by itself.

    Args:
        cut: limits of the wanted part.

    Attributes:
        over: whether an item later than the part has arrived.
    """

    def __init__(self, cut: LogCut) -> None:
        self._cut, self.over = cut, False
        self._origin_us: int | None = None
        self._begin_us, self._end_us = 0, 0
        self._first_us, self._last_us, self._passed = 0, 0, False

    def note(self, at_us: int) -> None:
        """Record the time of the first frame of one file.

        If the log has several files, times count from the earliest of these frames.
        """
        if self._origin_us is not None and self._origin_us <= at_us:
            return
        self._origin_us = self._first_us = self._last_us = at_us
        begin, end = self._cut.begin, self._cut.end
        self._begin_us = at_us if begin is None else begin.after(at_us)
        self._end_us = _NEVER_US if end is None else end.after(at_us)
        if begin is None:  # time may go back below the first frame
            self._begin_us = -_NEVER_US

    def noted(self, items: Iterator[Item]) -> Iterator[Item]:
        """Yield all items of a file, and record the time of the first frame."""
        for item in islice(items, 1):
            self.note(item.at_us)
            yield item
        yield from items

    def items(self, items: Sequence[Item]) -> list[Item]:
        """Return the items of the part. Earlier items are passed to `LogCut.earlier`."""
        if items and self._origin_us is None:
            self.note(items[0].at_us)
        passed: list[Item] = []
        for item in items:
            self._last_us = max(self._last_us, item.at_us)
            if item.at_us < self._begin_us:
                if self._cut.earlier is not None and isinstance(item, Record):
                    self._cut.earlier(item)
            elif item.at_us > self._end_us:
                self.over = True
            else:
                passed.append(item)
        self._passed = self._passed or any(isinstance(item, Record) for item in passed)
        return passed

    def block(self, block: Columns) -> Columns:
        """Return the frames of a block that belong to the part."""
        if len(block):
            if self._origin_us is None:
                self.note(int(block.at_us[0]))
            self._last_us = max(self._last_us, int(block.at_us.max()))
        inside = (block.at_us >= self._begin_us) & (block.at_us <= self._end_us)
        if not inside.all():
            block = column_blocks.select(block, inside.nonzero()[0])
        self._passed |= bool(len(block))
        return block

    @property
    def empty(self) -> bool:
        """Whether there were frames, but no frame was in the part."""
        return self._origin_us is not None and not self._passed

    def messages(self) -> list[str]:
        """Return a message if the wanted part has no frames.

        The message gives the time range of the log.
        """
        if not self.empty:
            return []
        span_s = (self._last_us - self._first_us) / 1e6
        dates = f"{date_text(self._first_us)} to {date_text(self._last_us)}"
        return [f"{self._cut}: no frame in this part; the log has {span_s:g} s, {dates}"]


_NEVER_US: Final = 1 << 62
_WHOLE: Final = LogCut()


# Opening what SOURCE words name: buses, serial ports, log files or standard input.


# Log files, merged by time, and standard input as sources.


_BATCH: Final = 1_024
"""Number of frames of one poll."""


class _LoggedSource(AnySource[Record]):
    """A log that returns frames up to the next marks at a time."""

    recorded = True

    def __init__(self, cut: LogCut = _WHOLE) -> None:
        self._items: Sequence[Item] = ()
        self._said_lost, self._no_more = 0, False
        self._cut = _CutLog(cut) if cut else None

    @property
    def lost(self) -> int:
        """Number of frames that the recorder lost before the next frames."""
        return super().lost if self._ended and self._cut is None else self._said_lost

    def _read(self, timeout_us: int) -> Sequence[Item]:
        """Return the next records, or none. `_no_more` is set at the end."""
        return []

    def poll(self, timeout_us: int, /) -> list[Record]:
        """Return the next frames of the log, up to the next mark.

        A mark is an event among the frames, such as lost frames.

        If the log comes through a pipe, the method waits for some frames.
        """
        if self._ended:
            self.marks = ()
            return []
        items = self._items
        if not items:
            items = self._read(timeout_us)
            if self._cut is not None:
                items = self._cut.items(items)
                self._no_more |= self.live and self._cut.over
        kinds = list(map(type, items))
        end = kinds.index(log_file.Mark) if log_file.Mark in kinds else len(kinds)
        marks = list(takewhile(lambda item: isinstance(item, log_file.Mark), items[end:]))
        self._items = items[end + len(marks) :]
        self._take_marks(cast("Sequence[log_file.Mark]", marks))
        self._ended = self._no_more and not self._items
        return cast("list[Record]", list(items[:end]))

    def _take_marks(self, marks: Sequence[log_file.Mark]) -> None:
        self._said_lost += sum(mark.frames for mark in marks)
        self.marks = [mark for mark in marks if mark.event != log_file.DROP]  # `lost` says these

    def close(self) -> None:
        """Stop reading."""
        super().close()
        self._items = ()


class FileSource(_LoggedSource):
    """One or more log files.

    Raises:
        SourceFailed: a file cannot be read.
    """

    def __init__(self, files: Sequence[FileSpec], cut: LogCut = _WHOLE) -> None:
        super().__init__(cut)
        self._names = [str(file.path) for file in files]
        self._silent = {str(file.path) for file in files if file.chosen is not None}
        self._readers = [read_log(file.path) for file in files]
        streams: list[Iterator[Item]] = []
        for file, reader in zip(files, self._readers, strict=True):
            _check_readable(file.path)
            items = reader.items() if self._cut is None else self._cut.noted(reader.items())
            if file.chosen is not None:
                items = self._passing(str(file.path), file.chosen, items)
            streams.append(items)
        merged = heapq.merge(*streams, key=lambda item: item.at_us)
        self._stream = streams[0] if len(streams) == 1 else merged

    def tallies(self) -> Iterable[tuple[str, log_file.LogTally]]:
        """Return the tally of each file, with its name."""
        return [
            (name, reader.tally) for name, reader in zip(self._names, self._readers, strict=True)
        ]

    def _read(self, timeout_us: int) -> list[Item]:
        batch: list[Item] = []
        try:
            batch.extend(islice(self._stream, _BATCH))
        except (OSError, log_file.LogError) as error:
            self.failed = str(error)
        self._no_more = len(batch) < _BATCH
        return batch

    def _passing(self, name: str, chosen: CandumpFilter, items: Iterator[Item]) -> Iterator[Item]:
        passing = (
            one for one in items if isinstance(one, log_file.Mark) or chosen.passes(flagged_id(one))
        )
        for one in passing:
            yield one
            if isinstance(one, Record):
                self._silent.discard(name)
                break
        yield from passing

    @property
    def nothing_passed(self) -> bool:
        """Whether there were frames, but a filter or a cut removed all of them."""
        return super().nothing_passed or (self._no_more and self._silent == {*self._names})

    def messages(self) -> list[str]:
        """Report invalid and lost frames, and filters that no frame passed."""
        silent = [name for name in self._names if self._no_more and name in self._silent]
        return [
            *super().messages(),
            *(f"{name}: no frame passes the filter after its name" for name in silent),
        ]

    def close(self) -> None:
        """Stop reading."""
        super().close()
        self._stream = iter(())


def _check_readable(path: Path) -> None:
    """Raise SourceFailed if a file cannot be read."""
    try:
        path.open("rb").close()
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror}") from error


STDIN: Final = 0
_READ_BYTES: Final = 1 << 16


class StdinSource(_LoggedSource):
    """Standard input: a pipe, a terminal, or a file that another program writes."""

    live = True

    def __init__(self, descriptor: int = STDIN, cut: LogCut = _WHOLE) -> None:
        super().__init__(cut)
        self._descriptor, self._lines = descriptor, LogLines()

    def tallies(self) -> Iterable[tuple[str, log_file.LogTally]]:
        """Return the tally of the input."""
        return [("standard input", self._lines.tally)]

    def _read(self, timeout_us: int) -> Sequence[Item]:
        """Wait for bytes. Return the content of complete lines."""
        if not ready([self._descriptor], wait_s=timeout_us / 1e6)[0]:
            return []
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except OSError as error:
            data, self.failed = b"", f"standard input: {error.strerror}"
        self._no_more = not data
        records = self._lines.push(data) if data else self._lines.finish()
        return among(records, self._lines.marks)


# A log file that is read in blocks, where that is faster than frame by frame.

SMALL_BYTES: Final = 1 << 20
"""Size below which reading a log frame by frame is faster than importing numpy."""


class BlockLog(AnySource["Columns"]):
    """Source that reads a log file in blocks of columns, which is faster than frame by frame.

    Each `poll` returns one block, and only one block is in memory.

    Attributes:
        no_columns: whether reading has ended early because this log must be read frame by frame.

    Raises:
        SourceFailed: the file cannot be read.
    """

    no_columns = False

    def __init__(self, path: Path, cut: LogCut = _WHOLE) -> None:
        _check_readable(path)
        self._cut = _CutLog(cut) if cut else None
        self._path, self._reader = path, column_reader.read_columns(path)
        self._blocks = iter(self._reader)

    def tallies(self) -> Iterable[tuple[str, log_file.LogTally]]:
        """Return the tally of the file."""
        return [(str(self._path), self._reader.tally)]

    def poll(self, timeout_us: int, /) -> list[Columns]:
        """Return the next block. The method never waits."""
        try:
            block = next(self._blocks)
            return [block if self._cut is None else self._cut.block(block)]
        except StopIteration:
            # a block does not say where frames were lost: in the part, or outside it
            self.no_columns = self._cut is not None and self.lost > 0
        except column_blocks.NoColumnsError:
            self.no_columns = True
        except log_file.LogError as error:
            self.failed = str(error)
        except OSError as error:
            self.failed = f"{self._path}: {error.strerror or error}"
        self._ended = True
        return []


class PieceLog(_LoggedSource):
    """Source that reads a log file in pieces: as columns if possible, otherwise as lists of frames.

    A mark is an event in the log, such as lost frames. A list of frames ends where the log has the
    next marks.

    Raises:
        SourceFailed: the file cannot be read.
    """

    def __init__(self, path: Path, cut: LogCut = _WHOLE) -> None:
        super().__init__(cut)
        _check_readable(path)
        self._path, self._reader = path, column_reader.read_columns(path)
        self._stream = self._reader.pieces()

    def tallies(self) -> Iterable[tuple[str, log_file.LogTally]]:
        """Return the tally of the file."""
        return [(str(self._path), self._reader.tally)]

    def pieces(self) -> Iterator[Columns | Sequence[Record]]:
        """Yield the pieces of the file. A piece is a block of columns, or a list of frames.

        When a piece is yielded, the attributes `lost` and `marks` have the values for the end of
        this piece.
        """
        ahead: Columns | Sequence[Item] | None = ()
        while not self._ended:
            if not self._items:
                # marks that follow each other are one event, wherever a piece ends
                items = list[Item]()
                while isinstance(ahead, Sequence) and len(items) < _BATCH:
                    items += ahead
                    ahead = self._next()
                self._items, self._no_more = items, ahead is None
                if not items and ahead is not None and not isinstance(ahead, Sequence):
                    self.marks, block, ahead = (), ahead, ()
                    yield block
                    continue
            yield self.poll(0)

    def _next(self) -> Columns | Sequence[Item] | None:
        try:
            piece = next(self._stream, None)
            if self._cut is None or piece is None:
                return piece
            if isinstance(piece, Sequence):
                return self._cut.items(piece)
            block = self._cut.block(piece)
            return block if len(block) else ()
        except (OSError, log_file.LogError) as error:
            self.failed = str(error)
        return None


def block_log(words: Sequence[str], cut: LogCut = _WHOLE) -> BlockLog | None:
    """Open a log for reading in blocks of many frames.

    The result is None if the SOURCE words do not name exactly one log, or if the log should be read
    frame by frame.

    Args:
        words: SOURCE words.
        cut: wanted part of the log. If its attribute `earlier` is set, the result is None.

    Raises:
        Refused: the words do not name a source.
        SourceFailed: a file cannot be read.
    """
    path = _large_log(words, cut)
    return None if path is None else BlockLog(path, cut)


def piece_log(words: Sequence[str], cut: LogCut = _WHOLE) -> PieceLog | None:
    """Open the log that SOURCE words name, to read it in pieces; see `block_log`."""
    path = _large_log(words, cut)
    return None if path is None else PieceLog(path, cut)


def _large_log(words: Sequence[str], cut: LogCut) -> Path | None:
    """Return the path of a log that should be read in blocks."""
    if cut.earlier or len(words) != 1 or find_spec("numpy") is None:
        return None
    word = parse_source(words[0])
    if not isinstance(word, FileSpec) or word.chosen is not None:
        return None
    try:
        return word.path if word.path.stat().st_size >= SMALL_BYTES else None
    except OSError:
        return None  # who reads it frame by frame says so


def open_source(
    words: Sequence[str], options: BusOptions | None = None, cut: LogCut = _WHOLE
) -> Source:
    """Open the source of a command that reads only CAN frames.

    The function is the same as `open_any`, except that it refuses serial ports.
    """
    source = open_any(words, options or BusOptions(), cut, lines_too=False)
    return cast("Source", source)  # without lines: frames


def open_any(
    words: Sequence[str], options: BusOptions, cut: LogCut = _WHOLE, *, lines_too: bool = True
) -> AnySource[AnyRecord]:
    """Open the source that SOURCE words name: buses and serial ports, files, or standard input.

    Several files are merged by time. Buses and serial ports are read as frames and messages arrive.

    Args:
        words: SOURCE words of the command. Without words, the options name a bus.
        options: interface, bit rate and other options of the buses.
        cut: wanted part of the files or of standard input. A bus cannot be cut, so such a part is
            refused.
        lines_too: whether serial ports are allowed.

    Raises:
        Refused: the words do not name a source, or the sources cannot be combined.
        SourceFailed: a bus or file cannot be opened.
    """
    if not words and not options:
        raise Refused(
            "no SOURCE: name a bus as can0, a log file as run.log, or - for standard input"
        )
    parsed = [parse_source(word) for word in words]
    files = [word for word in parsed if isinstance(word, FileSpec)]
    buses = [word for word in parsed if isinstance(word, BusSpec)]
    lines = [word for word in parsed if isinstance(word, LineSpec)]
    if parsed == [None]:
        return StdinSource(cut=cut)
    if len(files) == len(parsed) > 0:
        return FileSource(files, cut)
    if cut:
        raise Refused(f"{cut} is for a log; {' '.join(words) or 'a bus'} is not a log")
    if lines and not lines_too:
        raise Refused("serial lines are shown by dump, top and tui: " + " ".join(words))
    if len(buses) + len(lines) < len(parsed):
        what = "serial ports" if lines else "buses"
        raise Refused(f"{what}, files and standard input cannot be mixed: {' '.join(words)}")
    return _open_live(buses if parsed else [BusSpec()], lines, options)


def _open_live(
    buses: Sequence[BusSpec], lines: Sequence[LineSpec], options: BusOptions
) -> live_source.LiveSource[AnyRecord]:
    """Open buses and serial ports, so that they can be opened again."""
    opened: dict[str, bus_source.OpenBus] = {}
    readers: list[live_source.Reader[AnyRecord]] = []
    try:
        for word in buses:
            bus = bus_source.OpenBus(word, options)
            opened[bus.name] = bus
            reader: live_source.Reader[AnyRecord] = bus.reader
            readers.append(
                reader if reader.stepped else live_source.ReopeningReader(reader, bus.open_again)
            )
        for line in lines:
            reader = line_source.LineReader(line)
            readers.append(
                live_source.ReopeningReader(reader, partial(line_source.LineReader, line))
            )
    except BaseException as error:
        for reader in readers:
            reader.close()
        if isinstance(error, LinkClosed):
            raise SourceFailed(str(error)) from None
        raise
    chosen = [*(bus.chosen for bus in buses), *(None for _ in lines)]
    source = live_source.LiveSource(readers, chosen)
    source.buses = opened
    return source


def is_live(word: str) -> bool:
    """Return whether a SOURCE word is a bus, a serial port or standard input, not a log file."""
    return not isinstance(parse_source(word), FileSpec)
