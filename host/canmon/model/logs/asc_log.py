"""Reader of Vector's ASC logs with any header, with absolute and with relative times.

>>> lines, tally = _AscLines(), log_file.LogTally()
>>> for line in ("base hex  timestamps relative", " 0.100000 1  705  Rx d 1 7F", " 0.1 1  705  Rx d 1 05"):
...     record = lines.read(line, tally)
>>> record.at_us, record.channel, str(record.frame)
(200000, 'can0', '705#05')
"""  # noqa: E501 - as it is in a log

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Final

from tickrig.host.canmon.model.frames import AnyFrame, Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_reader import LineLogReader, bus_name
from tickrig.wire import can

_BUS_ERROR: Final = can.ErrorFrame(can.ErrorClass.BUS_ERROR)
"""Meaning of `ErrorFrame` in a line, which does not name the error as linux/can/error.h does."""

_FDF: Final = 0x1000
"""Flag of a CAN FD frame in a line `CANFD`. The bits above it are BRS and ESI."""
_RTR: Final = 0x10
_DECIMAL_DIGITS: Final = 3
"""Number of digits of a decimal byte that is padded with zeros."""

_TIMED: Final = re.compile(r"\s*([0-9]{1,12})\.([0-9]{1,9})\s+(.*\S)\s*", re.ASCII | re.DOTALL)
_CLASSIC: Final = re.compile(
    r"([0-9]+)\s+([0-9A-F]{1,10})(x?)\s+(Rx|Tx)\s+([dr])(?:\s+([0-9A-F]{1,2})\b)?(.*)",
    re.ASCII | re.IGNORECASE | re.DOTALL,
)
_ERROR: Final = re.compile(
    r"(?:CANFD\s+)?([0-9]+)\s+(?:(Rx|Tx)\s+)?ErrorFrame\b", re.ASCII | re.IGNORECASE
)
_LONG: Final = re.compile(
    r"(CANFD|CANXL)\s+([0-9]+)\s+(Rx|Tx)\s+(\S.*)", re.ASCII | re.IGNORECASE | re.DOTALL
)
_FRAME: Final = re.compile(
    r"CAN(?:FD|XL)\b(?!\s+[0-9]+\s+(?:(?:Rx|Tx)\s+)?[A-Z]+Frame\b|\s+[0-9]+\s+TxRq\b)"
    r"|[0-9]+\s+(?:[0-9A-F]+x?\b(?!\s+TxRq\b)|\S+\s+(?:Rx|Tx)\b)",
    re.ASCII | re.IGNORECASE,
)
"""Beginnings of lines that should be frames. Any other line with a time is an event."""

_SILENT: Final = re.compile(
    r"(?:$|//|date\b|base\b|(?:no\s+)?internal\s+events|(?:begin|end)\s+triggerblock)",
    re.IGNORECASE,
)
_BASE: Final = re.compile(
    r"base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE
)
_DATED: Final = re.compile(r"(date|begin\s+triggerblock)\s+(.*\S)", re.IGNORECASE | re.DOTALL)
_QUIET_EVENT: Final = re.compile(r"(?:Start of measurement|//)", re.IGNORECASE)

_STATE: Final = re.compile(
    r"CAN\s+[0-9]+\s+Status:\s*chip status (error passive|bus off|warning)", re.IGNORECASE
)
_STATES: Final = {
    "error passive": "that a controller is error passive",
    "bus off": "that a controller is bus-off",
    "warning": "that a controller has reached its warning limit",
}
_STATISTIC: Final = re.compile(r"[0-9]+\s+Statistic:.*\bE\s+0*[1-9]", re.ASCII | re.IGNORECASE)

_DATE: Final = re.compile(
    r"(?:\S+\s+)?(?P<month>\D\S{2,8})\s+(?P<day>[0-9]{1,2})\s+"
    r"(?P<hour>[0-9]{1,2}):(?P<minute>[0-9]{2}):(?P<second>[0-9]{2})(?:\.(?P<part>[0-9]{1,9}))?"
    r"(?:\s+(?P<half>[ap]m))?(?:\s+(?P<zone>[A-Z]{3,5}))?\s+(?P<year>[0-9]{4})",
    re.ASCII | re.IGNORECASE,
)
_MONTHS: Final = {
    **{
        name: number
        for number, name in enumerate(
            ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"), 1
        )
    },
    **{"mär": 3, "mrz": 3, "mai": 5, "okt": 10, "dez": 12},
}
"""Names in English, and in German if they differ. Vector's tools write names of the machine."""


class _AscLines:
    """Reader of the lines of an ASC log, in their order.

    Times count from the date of the header, or of the trigger block that contains the line. With
    `timestamps relative`, a time counts from the previous line that has a time.
    """

    def __init__(self) -> None:
        self._base, self._relative, self._guessed = 16, False, True
        self._header_us, self._block_us, self._pending = 0, 0, False
        self._now_us = 0

    def read(self, line: str, tally: log_file.LogTally) -> Record | str | None:
        """Parse one line of an ASC log.

        The result is a frame, a text for a valid line that holds no frame, or None for an invalid
        line.
        """
        timed = _TIMED.fullmatch(line)
        if timed is None:
            text = line.strip()
            return self._head(text, tally) if _SILENT.match(text) else None
        seconds, fraction, event = timed.groups()
        self._advance(int(seconds) * 1_000_000 + (int(f"{fraction:0<9}") + 500) // 1_000)
        return self._event(event, tally)

    def _head(self, text: str, tally: log_file.LogTally) -> str:
        """Read a line without a time, which describes the lines after it."""
        if base := _BASE.match(text):
            self._base, self._guessed = 10 if base[1].lower() == "dec" else 16, False
            self._relative = (base[2] or "").lower() == "relative"
        elif dated := _DATED.fullmatch(text):
            at_us = _date_us(dated[2])
            if at_us is None:
                tally.undated += 1
            elif dated[1].lower() == "date":
                self._header_us = self._block_us = self._now_us = at_us
            else:
                self._block_us, self._pending = at_us, True
                self._now_us = max(self._now_us, at_us) if self._relative else at_us
        return text

    def _advance(self, span_us: int) -> None:
        """Read the time of a line.

        The first time of a trigger block shows whether times continue to count from the header. If
        they do, the time corresponds to the date of the block.
        """
        if self._relative:
            self._now_us += span_us
            return
        if self._pending:
            self._pending = False
            # Nearer to the header's count than to a count from the block: times go on from
            # the header.
            if abs(self._header_us + span_us - self._block_us) < span_us:
                self._block_us = self._header_us
        self._now_us = self._block_us + span_us

    def _event(self, event: str, tally: log_file.LogTally) -> Record | str | None:
        if classic := _CLASSIC.fullmatch(event):
            channel, ident, extended, direction, kind, length, rest = classic.groups()
            frame = self._classic(ident, bool(extended), kind.lower() == "r", length, rest)
            return self._record(channel, direction, frame)
        if error := _ERROR.match(event):
            return self._record(error[1], error[2], _BUS_ERROR)
        if long := _LONG.fullmatch(event):
            kind, channel, direction, words = long.groups()
            fd = kind.upper() == "CANFD"
            frame_or_none = (self._fd if fd else self._xl)(words.split())
            if frame_or_none is None:
                return tally.pass_over(log_file.CAN_XL)
            return self._record(channel, direction, frame_or_none)
        if _FRAME.match(event):
            return None
        if not _QUIET_EVENT.match(event):
            tally.pass_over(log_file.OTHER_LINES)
            _note_errors(event, tally)
        return event

    def _record(self, channel: str, direction: str | None, frame: AnyFrame) -> Record:
        sent = (direction or "").lower() == "tx"
        return Record(self._now_us, bus_name(channel), frame, sent)

    def _classic(
        self, ident: str, extended: bool, remote: bool, length: str | None, rest: str
    ) -> can.CanFrame:
        """Return a frame. A length code above 8 means 8 bytes."""
        words, size = rest.split(), 0 if length is None else self._length(length)
        # Three digits a byte: `007 255` is decimal, hexadecimal bytes have two.
        if self._guessed and any(len(word) == _DECIMAL_DIGITS for word in words[:size]):
            self._base = 10  # BUSMASTER does not always write what the base is
        can_id, extended = self._can_id(ident, extended)
        if remote:
            return can.CanFrame(can_id, b"", True, extended, size).checked()
        if length is None:
            raise ValueError("a data frame without its length")
        return can.CanFrame(can_id, self._data(words, size), False, extended).checked()

    def _length(self, text: str) -> int:
        """Read a length code, which is one hexadecimal digit or more digits of the base."""
        # `d 8`, `d f`: one digit is hexadecimal whatever the base, codes above 8 mean eight
        # bytes.
        return min(can.MAX_DATA_BYTES, int(text, 16 if len(text) == 1 else self._base))

    def _can_id(self, digits: str, extended: bool) -> tuple[int, bool]:
        """Read an identifier. Some programs omit the x of a 29-bit identifier."""
        can_id = int(digits, self._base)
        return can_id, extended or can_id > can.STANDARD_MAX

    def _data(self, words: list[str], length: int) -> bytes:
        if len(words) < length:
            raise ValueError(f"{len(words)} bytes, {length} were announced")
        return bytes(int(word, self._base) for word in words[:length])

    def _fd(self, words: list[str]) -> AnyFrame:
        """Read the part of a line CANFD after the direction. A name may follow the CAN-ID."""
        ident, *words = words
        brs, esi, dlc, size, *rest = words[0 if words[0].isdecimal() else 1 :]
        length = int(size)
        data, flags = self._data(rest, length), _FDF
        if len(rest) > length + 2:  # behind the duration and the count of bits
            flags = int(rest[length + 2], 16)
        switches = can.BRS * (brs == "1") | can.ESI * (esi == "1")
        return self._flagged(ident, dlc, data, flags, switches)

    def _xl(self, words: list[str]) -> AnyFrame | None:
        """Read a line CANXL. Return None for a CAN XL frame."""
        kind, _, _, ident, *words = words
        if kind.upper() == "XLFF":
            return None
        dlc, size, *rest = words[0 if re.fullmatch("[0-9A-Fa-f]{1,2}", words[0]) else 1 :]
        length = int(size)
        fd = kind.upper().startswith("F")
        flags = int(rest[length + 1 + fd], 16)  # behind the stuff count of CAN FD, and the CRC
        switches = can.BRS * bool(flags & 2 * _FDF) | can.ESI * bool(flags & 4 * _FDF)
        return self._flagged(ident, dlc, self._data(rest, length), flags, switches)

    def _flagged(self, ident: str, dlc: str, data: bytes, flags: int, switches: int) -> AnyFrame:
        """Return the frame that the flags of a line define.

        The line may contain a classic frame.
        """
        can_id, extended = self._can_id(ident.rstrip("xX"), ident[-1:] in ("x", "X"))
        if flags & _FDF or len(data) > can.MAX_DATA_BYTES:
            return can.FdFrame(can_id, data, extended, switches).checked()
        if flags & _RTR:
            return can.CanFrame(can_id, b"", True, extended, self._length(dlc)).checked()
        return can.CanFrame(can_id, data, False, extended).checked()


def _note_errors(event: str, tally: log_file.LogTally) -> None:
    """Record a bus error in an event that no frame shows."""
    if state := _STATE.match(event):
        tally.errors_told[_STATES[state[1].lower()]] += 1
    elif _STATISTIC.match(event):
        tally.errors_told[log_file.ERRORS_COUNTED] += 1


def _date_us(text: str) -> int | None:
    """Parse a date of a header in local time. Return None if the text is not a date.

    >>> _date_us("Sam Sep 30 15:06:13.191 2017") == _date_us("Sat Sep 30 03:06:13.191 pm 2017")
    True
    >>> _date_us("yesterday") is None
    True
    """
    match = _DATE.fullmatch(text.strip())
    if match is None:
        return None
    month = _MONTHS.get(match["month"].lower()[:3].replace("\ufffd", "ä"))
    hour = int(match["hour"])
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"].lower() == "pm")
    zone = UTC if (match["zone"] or "").upper() in ("UTC", "GMT") else None
    year, day, minute, second = (int(match[name]) for name in ("year", "day", "minute", "second"))
    try:
        moment = datetime(year, month or 0, day, hour, minute, second, tzinfo=zone)
        seconds = int(moment.timestamp())
    except (ValueError, OverflowError, OSError):
        return None
    at_us = seconds * 1_000_000 + int(f"{match['part'] or '':0<6.6}")
    return at_us if at_us >= 0 else None


class AscLogReader(LineLogReader):
    """A reader of an ASC log."""

    comments = ("//",)
    make_lines = _AscLines
