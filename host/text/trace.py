r"""The text format of a recorded run.

    # tickrig-trace v1 rrc {"power_on_event": "PowerOn", "seed": 0}
    0.010000 < EV:Initialized\n
    0.400000 ! power_button=1
    0.710000 > output1e00\n
    0.710000 < OK:output\n
    2.000000 .

Each line has the time of the device's tick in seconds, a mark and a text. The marks are:

- `>` is traffic to the device, `<` is traffic from the device. Bytes are written by
  `byte_text.escape`.
- `!` is a physical input that changed before the tick.
- `.` is the duration of the run, which is the last line.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from tickrig.host.text.byte_text import escape, unescape
from tickrig.host.text.values import Setting, format_time, parse_setting

_VERSION: Final = 1
RESET: Final = "reset"

Config = Mapping[str, str | int | float | None]
"""Configuration of a device as in the header of its trace."""

BEGIN: Final = "# tickrig-trace v"
_VERSION_LINE: Final = re.compile(r"# tickrig-trace v([0-9]{1,9}) ")
_HEADER: Final = re.compile(r"# tickrig-trace v1 ([\w-]+) (\{.*\})")
_LINE: Final = re.compile(r"([0-9]{1,12})\.([0-9]{6}) ([<>!.])(?: (.*))?")
_INPUT: Final = re.compile(r"(\w+)=(-?[0-9]{1,18}(?:\.[0-9]{1,20})?(?:e[+-][0-9]{2,3})?)", re.ASCII)


class TraceError(ValueError):
    """The file is not a trace of this version."""


class Mark(StrEnum):
    """Kind of a line."""

    TO_DEVICE = ">"
    FROM_DEVICE = "<"
    PHYSICAL = "!"
    END = "."
    WIRE = "~"  # in version 2: see `bench_record`


@dataclass(frozen=True, slots=True)
class Header:
    """First line of a trace: type and settings of the recorded device, for a replay."""

    device: str
    config: Config = field(default_factory=dict)

    def encode(self) -> str:
        """Return the first line without LF."""
        return f"# tickrig-trace v{_VERSION} {self.device} {json.dumps(dict(self.config))}"


@dataclass(frozen=True, slots=True)
class Record:
    """One line of a trace: received or sent bytes, a change of an input, or the end.

    Attributes:
        at_us: time of the tick in microseconds.
        mark: character that defines the type of the line.
        data: bytes of a `>` or `<` line.
        text: text of a `!` line, which is `NAME=VALUE` or `reset`.
        line: number of the line in its file, from 1.
    """

    at_us: int
    mark: Mark
    data: bytes = b""
    text: str = ""
    line: int = 0

    def encode(self) -> str:
        """Return the line without LF."""
        rest = self.text if self.mark is Mark.PHYSICAL else escape(self.data)
        return f"{format_time(self.at_us)} {self.mark} {rest}".rstrip()

    @property
    def change(self) -> tuple[str, Setting]:
        """Name and value of the changed input in a `!` line."""
        name, _, value = self.text.partition("=")
        return name, parse_setting(value)


def trace_text(data: bytes) -> str:
    """Decode the bytes of a trace file to text.

    Raises:
        TraceError: the file is empty, is not ASCII, or its first line is incomplete.
    """
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError as error:
        raise TraceError(f"not a trace: byte {error.start} is not ASCII") from None
    if not text:
        raise TraceError("not a trace: it is empty")
    if "\n" not in text and (text.startswith(BEGIN) or BEGIN.startswith(text)):
        raise TraceError("line 1 is cut off: the header of the trace has no end")
    return text


def parse_header(line: str) -> Header:
    """Read the first line. Raise TraceError if it is not a valid header."""
    version = _VERSION_LINE.match(line)
    if version is not None and int(version[1]) != _VERSION:
        raise TraceError(f"this is trace version {int(version[1])}; versions 1 and 2 are known")
    match = _HEADER.fullmatch(line)
    if match is None:
        raise TraceError(
            f"line 1 is not '# tickrig-trace v{_VERSION} DEVICE {{CONFIG}}': {line!r:.60}"
        )
    try:
        return Header(match[1], json.loads(match[2]))
    except (ValueError, RecursionError) as error:
        raise TraceError(f"line 1: the configuration is not JSON: {error}") from None


def parse_record(line: str, number: int) -> Record:
    """Parse a line after the header. Raise TraceError if it is invalid."""
    match = _LINE.fullmatch(line)
    if match is None:
        raise TraceError(f"line {number} is not 'SECONDS MARK TEXT': {line!r:.60}")
    at_us = int(match[1]) * 1_000_000 + int(match[2])
    mark, rest = Mark(match[3]), match[4] or ""
    if mark is Mark.END:
        return Record(at_us, mark, line=number)
    if mark is Mark.PHYSICAL:
        if rest != RESET and not _INPUT.fullmatch(rest):
            raise TraceError(f"line {number}: {rest!r:.60} is not NAME=VALUE")
        return Record(at_us, mark, text=rest, line=number)
    try:
        return Record(at_us, mark, unescape(rest), line=number)
    except ValueError as error:
        raise TraceError(f"line {number}: {error}") from None


def parse_records(lines: Iterable[str]) -> Iterator[Record]:
    """Parse the lines of a trace after its header, and yield one record for each line.

    Raises:
        TraceError: a line is damaged, its time is before that of the line above, or it follows the
            end mark.
    """
    before = Record(0, Mark.PHYSICAL)
    for number, line in enumerate(lines, 2):
        record = parse_record(line, number)
        if record.at_us < before.at_us or before.mark is Mark.END:
            raise TraceError(f"line {number} is earlier than the line above it, or behind the end")
        yield record
        before = record
