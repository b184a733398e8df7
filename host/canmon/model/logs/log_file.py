"""Log files, with their formats by name, their times, and opening with or without gzip.

>>> to_us(1.25), to_us(0)
(1250000, 0)

>>> dropped(1_500_000, 12).json()
'{"v":1,"ev":"drop","t":1.5,"n":12,"text":"12 frames were lost"}'
>>> gone(0, "can0", "can0: Network is down").text
'can0 is gone: Network is down'
>>> back(3_250_000, "can0", 3_250_000).text
'can0 is back after 3.250000 s'
"""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Literal, NamedTuple, cast

from tickrig.host.text.steps import content_lines
from tickrig.host.text.values import counted

if TYPE_CHECKING:
    from io import BufferedReader


# Marks between the frames of a log: missing frames, and the reason of a recording.


DROP: Final = "drop"
GONE: Final = "gone"
BACK: Final = "back"
TRIGGER: Final = "trigger"
VERSION: Final = 1
DROP_COUNT: Final = "DROPCOUNT:"

_SAID: Final = re.compile(
    r"(?P<lost>[0-9]{1,15}) frames were lost|trigger: (?P<trigger>.{1,400})"
    r"|(?P<gone>\S{1,32}) is gone: (?P<why>.{1,400})"
    r"|(?P<back>\S{1,32}) is back after (?P<s>[0-9]{1,12})\.(?P<us>[0-9]{6}) s"
    rf"|{DROP_COUNT} dropped (?P<dropped>[0-9]{{1,15}}) CAN frames? on .{{1,100}}"
)
"""Comments that are marks, by the functions below, and candump's report of dropped frames."""


class Mark(NamedTuple):
    """An event among the frames of a log, such as lost frames or a bus that went away.

    Attributes:
        at_us: time of the event, or time on the clock of this machine if no frame gives the time.
        event: kind of the event, one of the constants of this module such as `GONE`.
        text: one line of text for display, in ASCII.
        channel: bus of the event, or empty if the event concerns all buses.
        frames: number of lost frames.
        away_us: time in microseconds during which the bus was away.
    """

    at_us: int
    event: str
    text: str
    channel: str = ""
    frames: int = 0
    away_us: int = 0

    def json(self) -> str:
        """Return the mark as a JSON object. Members without information are left out."""
        import json  # noqa: PLC0415 - seldom wanted

        said: dict[str, object] = {"v": VERSION, "ev": self.event, "t": self.at_us / 1e6}
        said |= {"ch": self.channel} if self.channel else {}
        said |= {"n": self.frames} if self.frames else {}
        said |= {"away": self.away_us / 1e6} if self.away_us else {}
        return json.dumps(said | {"text": self.text}, separators=(",", ":"))


def dropped(at_us: int, frames: int) -> Mark:
    """Return a mark for frames that were lost at this time."""
    return Mark(at_us, DROP, f"{frames} frames were lost", frames=frames)


def gone(at_us: int, channel: str, why: str) -> Mark:
    """Return the mark for a bus that went away.

    Args:
        at_us: time of the event.
        channel: name of the bus.
        why: reason, which may begin with the name of the bus.
    """
    reason = _plain(why.removeprefix(f"{channel}: "))
    return Mark(at_us, GONE, f"{_plain(channel)} is gone: {reason}", channel)


def back(at_us: int, channel: str, away_us: int) -> Mark:
    """Return a mark for a bus that is back."""
    away = f"{away_us // 1_000_000}.{away_us % 1_000_000:06d}"
    return Mark(at_us, BACK, f"{_plain(channel)} is back after {away} s", channel, away_us=away_us)


def triggered(at_us: int, why: str) -> Mark:
    """Return a mark for the trigger of a recording."""
    return Mark(at_us, TRIGGER, f"trigger: {_plain(why)}")


def read_mark(at_us: int, text: str) -> Mark | None:
    """Return the mark that a comment in a log describes, or None for any other comment.

    >>> read_mark(5, "can0 is back after 3.250000 s") == back(5, "can0", 3_250_000)
    True
    """
    said = _SAID.fullmatch(text.strip())
    if said is None:
        return None
    if lost := said["lost"] or said["dropped"]:
        return dropped(at_us, int(lost))
    if said["trigger"]:
        return triggered(at_us, said["trigger"])
    if said["gone"]:
        return gone(at_us, said["gone"], said["why"])
    return back(at_us, said["back"], int(said["s"]) * 1_000_000 + int(said["us"]))


def _plain(text: str) -> str:
    """Return text in one line of ASCII, which all formats can hold."""
    return " ".join(text.split()).encode("ascii", "backslashreplace").decode("ascii")


# Other items than frames in a log, which are counted so that no loss stays unreported.

_KEPT: Final = 5
"""Number of bad lines that are kept. Further bad lines are only counted."""

_SHOWN: Final = 60
"""Number of characters of a bad line that are shown."""


BAD_FRAMES: Final = "frames that CAN cannot have"
CAN_XL: Final = "CAN XL frames"
SERIAL_LINES: Final = "lines of a serial port"
ERRORS_COUNTED: Final = "that error frames were counted"
COUNTERS_TOLD: Final = "that error counters are above 0"
OTHER_LINES: Final = "lines with other events"
OTHER_OBJECTS: Final = "objects that are no frames"
NO_TIME: Final = "frames with an invalid time"
OTHER_PACKETS: Final = "packets of other links"
_NO_FRAMES: Final = (SERIAL_LINES, OTHER_LINES, OTHER_OBJECTS, OTHER_PACKETS)
"""Items that a log may hold in addition to frames."""


_FOREIGN: Final = {
    "***BUSMASTER": "a log of BUSMASTER",
    "Microchip Technology": "a log of Microchip's CAN BUS Analyzer",
    "GVRET-PC Reverse": "a CRTD log",
    "ID,Data Bytes": "a list of frames without times",
    "@ TEXT @": "a trace of CARBUS Analyzer",
}
"""Words in the first lines of logs of other programs, with the names of these programs."""


@dataclass(slots=True)
class _BadLines:
    """Lines that are invalid in their log.

    Attributes:
        count: number of bad lines.
        first: number and text of the first few lines.
    """

    count: int = 0
    first: list[tuple[int, str]] = field(default_factory=list)

    def add(self, number: int, line: str) -> None:
        """Count a line."""
        self.count += 1
        if len(self.first) < _KEPT:
            self.first.append((number, line))

    def messages(self, name: str) -> list[str]:
        """Report the counts, one line each, or nothing if there are none."""
        texts = [line for _, line in self.first]
        for begin, program in _FOREIGN.items():
            if any(begin in text for text in texts):
                hint = "SavvyCAN saves it as GVRET, which is read"
                return [f"{name}: {program} is not read ({self.count} lines); {hint}"]
        said = [
            f"{name}: line {number} is no frame: {line!a:.{_SHOWN}}" for number, line in self.first
        ]
        if self.count > len(self.first):
            said.append(f"{name}: {self.count} lines are no frames; the first {_KEPT} are shown")
        return said


@dataclass(slots=True)
class LogTally:
    """Counts of items that were not returned as frames.

    Attributes:
        bad_lines: invalid lines.
        passed_over: number of skipped items by kind: frames that are not read, such as CAN XL, and
            items that are not frames (`_NO_FRAMES`).
        lost: frames that the recorder reports as lost.
        untimed: frames without a time in the log. Such a frame gets the time of the previous frame.
        undated: number of unreadable dates. Times after such a date count from 0.
        shifted_us: offset added to the times of the log.
        errors_told: number of items that are not frames and report bus errors, by kind.
        without_errors: reason why the log cannot contain error frames, empty if it can.
    """

    bad_lines: _BadLines = field(default_factory=_BadLines)
    passed_over: Counter[str] = field(default_factory=Counter)
    lost: int = 0
    untimed: int = 0
    undated: int = 0
    shifted_us: int = 0
    errors_told: Counter[str] = field(default_factory=Counter)
    without_errors: str = ""

    def pass_over(self, what: str) -> str:
        """Count an item that is no frame. Return what it is."""
        self.passed_over[what] += 1
        return what

    @property
    def unread(self) -> int:
        """Number of lines and frames that arrived and were not returned."""
        frames = sum(n for what, n in self.passed_over.items() if what not in _NO_FRAMES)
        return self.bad_lines.count + frames

    def messages(self, name: str) -> list[str]:
        """Report the counts, one line each, or nothing if all items were returned."""
        return self.losses(name) + self.remarks(name)

    def losses(self, name: str) -> list[str]:
        """Report items that were lost or could not be read."""
        said = self.bad_lines.messages(name) + self._passed_over(name, no_frames=False)
        return said + ([f"{name}: its recorder lost {self.lost} frames"] if self.lost else [])

    def remarks(self, name: str) -> list[str]:
        """Report other notes about the log."""
        said = [f"{name}: {self.untimed} frames have no time"] if self.untimed else []
        said += [f"{name}: its date cannot be read: times begin at 0"] if self.undated else []
        if self.shifted_us:
            why = "they begin below 0, or their counter overflows"
            said.append(f"{name}: {self.shifted_us} us were added to its times: {why}")
        return self._passed_over(name, no_frames=True) + said

    def errors(self, name: str) -> list[str]:
        """Report bus errors in the log besides its error frames, one line each."""
        told = self.errors_told.items()
        return [f"{name}: it says {text}: {counted(count, 'time')}" for text, count in told]

    def _passed_over(self, name: str, *, no_frames: bool) -> list[str]:
        return [
            f"{name}: {count} {what} passed over"
            for what, count in self.passed_over.items()
            if count and (what in _NO_FRAMES) is no_frames
        ]


class LogFormat(StrEnum):
    """Formats of log files."""

    CANDUMP = "candump"
    JSONL = "jsonl"
    ASC = "asc"
    BLF = "blf"
    TRC = "trc"
    CSV = "csv"
    GVRET = "gvret"
    MF4 = "mf4"
    TRACE = "trace"
    PCAPNG = "pcapng"
    PCAP = "pcap"


_FORMATS: Final = {
    LogFormat(words[0]): words[1:]
    for _, line in content_lines(Path(__file__).with_name("formats.txt").read_text("ascii"))
    if (words := [word.strip() for word in line.split("|")])
}
SUFFIXES: Final = {suffix: kind for kind, one in _FORMATS.items() for suffix in one[0].split()}
COMPRESSED: Final = ".gz"


class LogFormatError(ValueError):
    """A file name that indicates no format."""


class LogError(ValueError):
    """A log file cannot be read or written.

    The file is truncated, is not a log of its format, or has a format that this machine cannot
    write.
    """


def log_format(path: Path) -> LogFormat:
    """Return the log format that the name of a file indicates, such as ASC for `run.asc.gz`.

    Raises:
        LogFormatError: the name of the file indicates no format.

    >>> log_format(Path("run.asc.gz")).value, log_format(Path("run.gvret.csv")).value
    ('asc', 'gvret')
    """
    suffix = log_ending(path).lower().removesuffix(COMPRESSED)
    if suffix not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise LogFormatError(f"{path}: a log's name ends in {known}, with .gz behind it or not")
    return SUFFIXES[suffix]


def check_written(path: Path, kind: LogFormat) -> None:
    """Raise LogError if a log with this path and format cannot be written.

    The format pcap can only be read. BLF and MF4 logs are already compressed, so their names must
    not end in `.gz`.
    """
    if kind is LogFormat.PCAP:
        raise LogError(f"{path}: pcap is read alone; a name in .pcapng is written")
    if kind in (LogFormat.BLF, LogFormat.MF4) and path.suffix.lower() == COMPRESSED:
        raise LogError(f"{path}: {kind} is compressed by itself, it is not written with .gz")


def reader_of(kind: LogFormat) -> Any:
    """Return the reader class of a format."""
    return _class_at(_FORMATS[kind][1])


def writer_of(kind: LogFormat) -> Any:
    """Return the writer class of a format."""
    return _class_at(_FORMATS[kind][2])


def _class_at(place: str) -> Any:
    module, _, name = place.partition(".")
    return getattr(import_module(f"{__package__}.{module}"), name)


def log_ending(path: Path) -> str:
    """Return the end of a file's name, such as `.log`, `.gvret.csv` or `.asc.gz`."""
    suffixes = path.suffixes
    count = 1 + (path.suffix.lower() == COMPRESSED)
    longer = "".join(suffixes[-count - 1 :])
    if longer.lower().removesuffix(COMPRESSED) in SUFFIXES:
        return longer
    return "".join(suffixes[-count:])


END_S: Final = 10**12
"""Limit of seconds, because a candump log may have twelve digits in front of the dot."""


def to_us(seconds: float) -> int:
    """Return microseconds. Raise ValueError for an invalid time: nan, below 0, `END_S` or more."""
    if not 0 <= seconds < END_S:
        raise ValueError(f"{seconds!r} s is not 0 to below 1e12 s")
    return round(seconds * 1e6)


def open_log(path: Path, mode: Literal["rb", "wb"] = "rb") -> BinaryIO:
    """Open a file for reading or writing, through gzip if its name requires this."""
    if path.suffix.lower() != COMPRESSED:
        return path.open(mode)
    import gzip  # noqa: PLC0415 - seldom wanted

    return cast("BinaryIO", gzip.open(path, mode))  # it is read and written like one


def read_blocks(file: BinaryIO, path: Path, block_bytes: int) -> Iterator[bytes]:
    """Read an open text log, compressed or not, and yield its bytes in pieces.

    If a compressed file is truncated or damaged, the readable part is yielded first.

    Raises:
        LogError: the file is truncated or damaged. The message contains the position in the file.
        OSError: the file cannot be read.
    """
    pieces, held, lines = list[bytes](), 0, 0
    try:
        some = cast("BufferedReader", file).read1  # `read` loses the end of a cut log
        while data := some(block_bytes):
            pieces.append(data)
            held, lines = held + len(data), lines + data.count(b"\n")
            if held >= block_bytes:
                yield b"".join(pieces)
                pieces, held = [], 0
    except (EOFError, zlib.error, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        yield b"".join(pieces)
        said = " ".join(str(error).split())
        raise LogError(f"{path}: cut or damaged behind line {lines}: {said}") from error
    if pieces:
        yield b"".join(pieces)
