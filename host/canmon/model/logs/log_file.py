"""Log files: their formats by name, their times, opened with or without gzip.

>>> to_us(1.25), to_us(0)
(1250000, 0)
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Literal, cast

from tickrig.host.text.steps import content_lines

if TYPE_CHECKING:
    from io import BufferedReader


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

NO_MF4: Final = "MF4 needs asammdf: pip install 'python-can[mf4]'"
"""Said where it is not there."""

TEXT: Final = (LogFormat.CANDUMP, LogFormat.JSONL, LogFormat.CSV, LogFormat.GVRET)
"""Formats of lines that `LogLines` reads."""


class LogFormatError(ValueError):
    """A name that tells no format."""


class LogError(ValueError):
    """A file that is no log or ends in the middle, or a format that cannot be written here."""


def log_format(path: Path) -> LogFormat:
    """Return the format of a file.

    Raises:
        LogFormatError: its name does not tell.

    >>> log_format(Path("run.asc.gz")).value, log_format(Path("run.gvret.csv")).value
    ('asc', 'gvret')
    """
    suffix = log_ending(path).lower().removesuffix(COMPRESSED)
    if suffix not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise LogFormatError(f"{path}: a log's name ends in {known}, with .gz behind it or not")
    return SUFFIXES[suffix]


def reader_of(kind: LogFormat) -> Any:
    """Return the class that reads a format."""
    return _class_at(_FORMATS[kind][1])


def writer_of(kind: LogFormat) -> Any:
    """Return the class that writes a format."""
    return _class_at(_FORMATS[kind][2])


def _class_at(place: str) -> Any:
    module, _, name = place.partition(".")
    return getattr(import_module(f"{__package__}.{module}"), name)


def log_ending(path: Path) -> str:
    """Return the end of a file's name, as `.log`, `.gvret.csv` or `.asc.gz`."""
    suffixes = path.suffixes
    count = 1 + (path.suffix.lower() == COMPRESSED)
    longer = "".join(suffixes[-count - 1 :])
    if longer.lower().removesuffix(COMPRESSED) in SUFFIXES:
        return longer
    return "".join(suffixes[-count:])


END_S: Final = 10**12
"""Twelve digits of seconds: what a candump log may have in front of the dot."""


def to_us(seconds: float) -> int:
    """Return microseconds; ValueError if that is no time: nan, below 0, `END_S` or more."""
    if not 0 <= seconds < END_S:
        raise ValueError(f"{seconds!r} s is not 0 to below 1e12 s")
    return round(seconds * 1e6)


def open_log(path: Path, mode: Literal["rb", "wb"] = "rb") -> BinaryIO:
    """Open a file for reading or writing, through gzip where its name says so."""
    if path.suffix.lower() != COMPRESSED:
        return path.open(mode)
    import gzip  # noqa: PLC0415 - seldom wanted

    return cast("BinaryIO", gzip.open(path, mode))  # it is read and written like one


def read_blocks(file: BinaryIO, path: Path, block_bytes: int) -> Iterator[bytes]:
    """Read a log in text that was opened, so many bytes or little more at a time.

    Of a compressed file that is cut or damaged all comes that can be read.

    Raises:
        LogError: behind that: where it is cut or damaged.
        OSError: it cannot be read.
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
