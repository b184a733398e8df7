"""Log files: their formats by name, their times, opened with or without gzip.

>>> to_us(1.25), to_us(0)
(1250000, 0)
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import BinaryIO, Final, Literal, cast


class LogFormat(StrEnum):
    """Formats of log files."""

    CANDUMP = "candump"
    JSONL = "jsonl"
    ASC = "asc"
    BLF = "blf"
    TRC = "trc"
    CSV = "csv"
    MF4 = "mf4"
    TRACE = "trace"


SUFFIXES: Final = {
    ".log": LogFormat.CANDUMP,
    ".candump": LogFormat.CANDUMP,
    ".txt": LogFormat.CANDUMP,
    ".jsonl": LogFormat.JSONL,
    ".asc": LogFormat.ASC,
    ".blf": LogFormat.BLF,
    ".trc": LogFormat.TRC,
    ".csv": LogFormat.CSV,
    ".mf4": LogFormat.MF4,
    ".trace": LogFormat.TRACE,
}

COMPRESSED: Final = ".gz"

TEXT: Final = (LogFormat.CANDUMP, LogFormat.JSONL, LogFormat.CSV)
"""Formats of lines that `LogLines` reads."""


class LogFormatError(ValueError):
    """A name that tells no format."""


class LogError(ValueError):
    """A file that is no log or ends in the middle, or a format that cannot be written here."""


def log_format(path: Path) -> LogFormat:
    """Return the format of a file.

    Raises:
        LogFormatError: its name does not tell.

    >>> log_format(Path("run.asc.gz")).value
    'asc'
    """
    suffix = Path(path.stem if path.suffix.lower() == COMPRESSED else path).suffix.lower()
    if suffix not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise LogFormatError(f"{path}: a log's name ends in {known}, with .gz behind it or not")
    return SUFFIXES[suffix]


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
