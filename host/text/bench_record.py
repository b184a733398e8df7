r"""The text format of bench recordings: version 2 of traces.

    # tickrig-trace v2 {"seed": 0, "wires": {"bus": {"type": "can", "bit_rate": 500000}}, "devices": {"left": {"wire": "bus", "type": "epos", "node_id": 5}}}
    0.000000 left < 705#00
    0.310000 left > 605#2B40600006000000
    0.310000 left < 585#6040600000000000
    0.400000 left ! load_nm=1.5
    0.500000 bus ~ drop=0.1
    0.512000 left ! bus_state error-passive
    2.000000 .

Each line has a time in seconds, the name of a device or wire, a mark and a text. The marks are:

- `>` is traffic to the device, `<` is traffic from the device. Bytes are written by
  `byte_text.escape`. Frames are written as candump does, one per line.
- `!` is a change made to the device before that tick: an input or an object was set, `reset`, or a
  report of its CAN controller.
- `~` is a fault of a wire that started, or ended (`=0`).
- `.` is the duration of the run.
"""  # noqa: E501 - a line of the file

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from math import isfinite
from typing import Final, NamedTuple

from tickrig.host.text.bench_header import BenchHeader
from tickrig.host.text.byte_text import escape, unescape
from tickrig.host.text.trace import RESET, Mark, TraceError
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.can import CanFrame, ErrorState
from tickrig.wire.errors import WireError

_LINE: Final = re.compile(r"([0-9]{1,12})\.([0-9]{6}) ((\w[\w./:-]*) ([<>!~]) (.*)|\.)", re.ASCII)
_CHANGE: Final = re.compile(r"([\w./:-]{1,200})=(.{1,9999})", re.ASCII)
_FAULT: Final = re.compile(r"\w{1,99}(?:=[\w.:,=+-]{1,200})?", re.ASCII)

_KEPT_LINES: Final = 4_096

BUS_STATE: Final = {
    f"bus_state {name}": state
    for name, state in (
        ("error-active", ErrorState.ACTIVE),
        ("error-passive", ErrorState.PASSIVE),
        ("bus-off", ErrorState.BUS_OFF),
    )
}
"""Reports of a CAN controller to its device, by their text in a line."""


class BenchRecord(NamedTuple):
    """One line of a trace of version 2: traffic, a change of an input, or the end of the recording.

    A mark in the line shows its type: `>` for traffic to the device, `<` for traffic from the
    device, `!` for a change at the device, such as a new input value or a reset, `~` for a fault of
    the wire that starts or ends, and `.` for the end of the recording.

    Attributes:
        at_us: time of the tick, or time at the host's port, in microseconds.
        name: name of the device, or name of the wire in a line with the mark `~`.
        mark: character that defines the type of the line.
        traffic: bytes or CAN frame of a `>` or `<` line.
        text: text of a `!` or `~` line.
        line: number of the line in its file, from 1.
    """

    at_us: int
    name: str
    mark: Mark
    traffic: bytes | CanFrame = b""
    text: str = ""
    line: int = 0

    def encode(self) -> str:
        """Return the line without LF."""
        if self.mark is Mark.END:
            return f"{format_time(self.at_us)} ."
        return f"{format_time(self.at_us)} {self.name} {self.mark} {self.written}"

    @property
    def written(self) -> str:
        """Text after the mark."""
        traffic = self.traffic
        return self.text or (escape(traffic) if isinstance(traffic, bytes) else str(traffic))

    @property
    def change(self) -> tuple[str, Setting] | None:
        """Name and new value of the input that a `!` line has changed.

        The result is None if the line records a reset or the state of a CAN controller.
        """
        name, equals, value = self.text.partition("=")
        return (name, json.loads(value)) if equals else None


def change_text(name: str, value: Setting) -> str:
    """Return the text of a `!` line that sets an input.

    >>> change_text("0x1008", "a b"), change_text("load_nm", 0.5)
    ('0x1008="a b"', 'load_nm=0.5')
    """
    return f"{name}={json.dumps(value) if isinstance(value, str) else value + 0}"


class BenchParser:
    """Parser for the lines of a trace of version 2 after its header.

    Args:
        header: header of the trace, whose device and wire names the lines use.
    """

    def __init__(self, header: BenchHeader) -> None:
        self._header = header
        self._on_can = {name: header.on_can(name) for name in header.devices}
        self._known: dict[str, BenchRecord] = {}

    def parse(self, lines: Iterable[str]) -> Iterator[BenchRecord]:
        """Parse the lines of the trace, and yield one record for each; times must not decrease.

        Raises:
            TraceError: a line is damaged, a line has an earlier time than the line before it, or a
                line follows the end mark.
        """
        made, known, before_us, ended = tuple.__new__, self._known, 0, False
        for number, line in enumerate(lines, 2):
            at, _, rest = line.partition(" ")
            digits = at[:-7] + at[-6:]
            if rest in known and at[-7:-6] == "." and 7 <= len(digits) <= 18 and digits.isdigit():
                _, name, mark, traffic, text, _ = known[rest]
                record = made(BenchRecord, (int(digits), name, mark, traffic, text, number))
            else:
                try:
                    record = self._record(line, number)
                except (ValueError, WireError, RecursionError) as error:
                    raise TraceError(f"line {number}: {error}") from None
            if record.at_us < before_us or ended:
                raise TraceError(
                    f"line {number} is earlier than the line above it, or behind the end"
                )
            yield record
            before_us, ended = record.at_us, record.mark is Mark.END

    def _record(self, line: str, number: int) -> BenchRecord:
        """Read a line and cache its content, because many lines differ only in their time."""
        match = _LINE.fullmatch(line)
        if match is None:
            raise ValueError(f"not 'SECONDS NAME MARK TEXT': {line!r:.60}")
        seconds, micros, rest, name, mark, text = match.groups()
        if len(self._known) >= _KEPT_LINES:
            self._known.clear()
        known = self._known[rest] = self._read(name, mark, text)
        at_us = int(seconds) * 1_000_000 + int(micros)
        return known._replace(at_us=at_us, line=number)

    def _read(self, name: str | None, mark: str, text: str) -> BenchRecord:
        """Read the part after the time."""
        if name is None:
            return BenchRecord(0, "", Mark.END)
        if mark == Mark.WIRE:
            _check_fault(text, name in self._header.wires or name in self._header.devices)
            return BenchRecord(0, name, Mark.WIRE, text=text)
        if name not in self._on_can:
            raise ValueError(f"no device {name:.60} in the header")
        if mark == Mark.PHYSICAL:
            _check_change(text)
            return BenchRecord(0, name, Mark.PHYSICAL, text=text)
        traffic = CanFrame.parse(text) if self._on_can[name] else unescape(text)
        return BenchRecord(0, name, Mark(mark), traffic)


def _check_fault(text: str, known: bool) -> None:
    if not known or not _FAULT.fullmatch(text):
        raise ValueError(f"no such wire or device in the header, or {text!r:.60} is no fault")


def _check_change(text: str) -> None:
    if text == RESET or text in BUS_STATE:
        return
    match = _CHANGE.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r:.60} is not NAME=VALUE")
    try:
        value = json.loads(match[2])
    except RecursionError:
        value = None
    if type(value) not in (int, float, str) or (type(value) is float and not isfinite(value)):
        raise ValueError(f"{text!r:.60} is no number and no string")
