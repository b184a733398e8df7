"""Reader of PEAK's traces (TRC) of versions 1.0 to 3.0, with their error frames.

>>> lines, tally = _TrcLines(), log_file.LogTally()
>>> lines.read(";$FILEVERSION=1.1", tally)
';$FILEVERSION=1.1'
>>> record = lines.read("     6)      1349.2  Error      0008  4  00 19 08 08", tally)
>>> record.at_us, record.channel, str(record.frame)
(1349200, 'can0', '200002A8#0000801900000808')
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import takewhile
from typing import Final, NamedTuple

from tickrig.host.canmon.model.frames import AnyFrame, Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_file import END_S
from tickrig.host.canmon.model.logs.log_reader import LineLogReader, bus_name
from tickrig.wire import can

_VERSIONS: Final = {
    "1.0": ("N", "O", "I", "L", "D"),
    "1.1": ("N", "O", "T", "I", "L", "D"),
    "1.2": ("N", "O", "B", "T", "I", "L", "D"),
    "1.3": ("N", "O", "B", "T", "I", "R", "L", "D"),
}
"""Columns by version: number, offset in ms, bus, type, CAN-ID, reserved, length, data, direction.
From version 2.0 on, the file names the columns. `l` is a count of bytes, `L` a length code.
"""

_FD_FLAGS: Final = {"FD": 0, "FB": can.BRS, "BI": can.ESI, "FE": can.BRS | can.ESI}
"""Types of CAN FD frames."""

ERROR: Final = "ERROR"
"""Word before the data of an error frame in version 1.0."""
_ERRORS: Final = ("Error", "ER")
_STATES: Final = ("Warng", "ST")
_COUNTERS: Final = "EC"
_EVENT: Final = "EV"

_DAYS_TO_1970: Final = 25_569
_DAY_US: Final = 86_400_000_000
_LATEST_DAYS: Final = 2_958_465
"""Number of days until the end of 9999."""

_HEAD: Final = re.compile(r";\$(FILEVERSION|STARTTIME|COLUMNS)=\s*(\S+)", re.IGNORECASE)
_OFFSET: Final = re.compile(r"(-?)([0-9]{1,16})(?:\.([0-9]{1,9}))?", re.ASCII)
_NUMBER: Final = re.compile(r"[0-9]+\)?", re.ASCII)
_CAN_ID: Final = re.compile(r"[0-9A-Fa-f]{1,8}")
_BYTE: Final = re.compile(r"[0-9A-Fa-f]{2}")
_LENGTH: Final = re.compile(r"[0-9]{1,2}", re.ASCII)

_STANDARD_DIGITS: Final = 4
"""Number of digits above which a CAN-ID has 29 bits."""

_STATUS: Final = {
    0x10: "that a controller is bus-off",
    0x4_0000: "that a controller is error passive",
    0x08: "that a controller has reached its warning limit (BUSHEAVY)",
    0x04: "that a controller has reached its warning limit (BUSLIGHT)",
}
"""Bits of a status (PCAN-Basic, PCAN_ERROR_...). The worst bit is first."""

_KINDS: Final = {1: can.ProtocolFlag.BIT, 2: can.ProtocolFlag.FORM, 4: can.ProtocolFlag.STUFFING}
_ACK_SLOT: Final = 0x19
_SEGMENT: Final = 0x1F
"""Mask of the place of an error in the frame, as in the SJA1000, and in byte 3 of Linux."""


class _Row(NamedTuple):
    """The columns of a line by letter."""

    cells: dict[str, str]
    data: list[str]

    def hex_bytes(self) -> bytes:
        """Return the data bytes of the row.

        They end at the first word that is not a byte, such as `BUSHEAVY`.
        """
        return bytes.fromhex("".join(takewhile(_BYTE.fullmatch, self.data)))


class _TrcLines:
    """Reader of the lines of a trace, in their order."""

    def __init__(self) -> None:
        self._version, self._start_us = "1.0", 0
        self._columns: Sequence[str] = _VERSIONS["1.0"]

    def read(self, line: str, tally: log_file.LogTally) -> Record | str | None:
        """Parse one line of a TRC log.

        The result is a frame, a text for a valid line that holds no frame, or None for an invalid
        line.

        Raises:
            LogError: the header names columns that are unknown.
        """
        text = line.strip()
        if not text or text.startswith(";"):
            if head := _HEAD.match(text):
                self._head(head[1].upper(), head[2].rstrip(";"), tally)
            return text
        if not self._columns:
            raise log_file.LogError("File has no column information: ;$COLUMNS= is missing")
        number, *words = text.split()
        if not _NUMBER.fullmatch(number) or not words:
            return None
        return self._row(number, words, tally)

    def _head(self, word: str, value: str, tally: log_file.LogTally) -> None:
        """Read a header line, which describes the file."""
        match word:
            case "FILEVERSION":
                self._version, self._columns = value, _VERSIONS.get(value, ())
            case "COLUMNS" if self._version not in _VERSIONS:
                self._columns = value.split(",")
            case "STARTTIME":
                start_us = _start_us(value)
                tally.undated += start_us is None
                self._start_us = start_us or 0

    def _row(self, number: str, words: list[str], tally: log_file.LogTally) -> Record | str | None:
        at_us, row = self._at_us(words[0]), self._cells([number, *words])
        kind = row.cells.get("T", "Rx")
        what = log_file.NO_TIME if not 0 <= at_us < END_S * 1_000_000 else _aside(row, kind, tally)
        if what:
            return tally.pass_over(what)
        is_error = kind in _ERRORS or row.data[:1] == [ERROR]
        frame = _error(row) if is_error else _frame(row, kind)
        sent = "Tx" in (kind, row.cells.get("d"))
        return Record(at_us, bus_name(row.cells.get("B", "1")), frame, sent)

    def _at_us(self, offset: str) -> int:
        match = _OFFSET.fullmatch(offset)
        if match is None:
            raise ValueError(f"{offset!r} is no offset")
        sign, whole, part = match.groups()
        # Milliseconds with up to six digits behind the dot, in whole numbers: a float would
        # lose the last microseconds of a long trace.
        nanos = int(whole) * 1_000_000 + int(f"{part or '':0<6.6}")
        return self._start_us + int(f"{sign}1") * ((nanos + 500) // 1_000)

    def _cells(self, words: list[str]) -> _Row:
        """Separate the columns. Lines without a CAN-ID omit some, and version 2.0 omits others."""
        names = list(self._columns)
        place = names.index("T") if "T" in names else len(words)
        kind = words[place] if place < len(words) else ""
        # From 2.0 on errors, counters, states and events leave out columns, the CAN-ID at
        # least: bus and direction are found by what they look like.
        if kind not in ("ER", "EC", "ST", _EVENT):
            count = names.index("D")
            return _Row(dict(zip(names, words[:count], strict=False)), words[count:])
        cells = dict(zip(names[: place + 1], words, strict=False))
        behind = words[place + 1 :]
        if "B" in names and names.index("B") > place and behind:
            cells["B"] = behind.pop(0)
        at = next((n for n, word in enumerate(behind) if word in ("Rx", "Tx")), None)
        if at is None:
            return _Row(cells, behind)
        cells["d"], data = behind[at], behind[at + 1 :]
        while data and not _BYTE.fullmatch(data[0]):  # what is reserved, and the length
            del data[0]
        return _Row(cells, data)


def _aside(row: _Row, kind: str, tally: log_file.LogTally) -> str:
    """Return the kind of a line that is not a CAN or CAN FD frame. Record errors in the line."""
    if kind == "XL":
        return log_file.CAN_XL
    # Version 1.0 has no type; a status has the CAN-ID FFFFFFFFh there.
    if kind in _STATES or row.cells.get("I") == "FFFFFFFF":
        _note_status(row.hex_bytes(), tally)
    elif kind == _COUNTERS:
        if any(row.hex_bytes()):
            tally.errors_told[log_file.COUNTERS_TOLD] += 1
    elif kind != _EVENT:
        return ""
    return log_file.OTHER_LINES


def _start_us(days: str) -> int | None:
    """Return the start of a trace, or None if it is not a date since 1970."""
    try:
        value = float(days)
    except ValueError:
        return None
    if not _DAYS_TO_1970 <= value <= _LATEST_DAYS:
        return None
    # STARTTIME is a date of Delphi: days since 30 December 1899 with a fraction.
    return round((value - _DAYS_TO_1970) * _DAY_US)


def _frame(row: _Row, kind: str) -> AnyFrame:
    """Return a data or remote frame."""
    if kind not in ("Rx", "Tx", "DT", "RR", *_FD_FLAGS):
        raise ValueError(f"{kind!r} is no type of a frame")
    ident = row.cells["I"]
    if not _CAN_ID.fullmatch(ident):
        raise ValueError(f"{ident!r} is no CAN-ID")
    can_id, extended = int(ident, 16), len(ident) > _STANDARD_DIGITS
    length = _length(row.cells, fd=kind in _FD_FLAGS)
    if kind == "RR" or row.data[:1] in (["RTR"], ["R"]):
        return can.CanFrame(can_id, b"", True, extended, min(can.MAX_DATA_BYTES, length)).checked()
    data = row.hex_bytes()
    if len(data) != length:
        raise ValueError(f"{len(data)} bytes, {length} were announced")
    if kind in _FD_FLAGS:
        return can.FdFrame(can_id, data, extended, _FD_FLAGS[kind]).checked()
    return can.CanFrame(can_id, data, False, extended).checked()


def _length(cells: dict[str, str], *, fd: bool) -> int:
    """Return the number of bytes of a frame. A classic length code above 8 means 8 bytes."""
    text = cells["l"] if "l" in cells else cells["L"]
    if not _LENGTH.fullmatch(text):
        raise ValueError(f"{text!r} is no length")
    if "l" in cells:
        return int(text)
    return can.FD_LENGTHS[int(text)] if fd else min(can.MAX_DATA_BYTES, int(text))


def _error(row: _Row) -> can.ErrorFrame:
    """Return an error frame in the notation of Linux.

    Up to version 1.3, the CAN-ID is the type of the error, and the data are direction, place and
    both counters. From version 2.0 on, the data begin with the type.
    """
    data = [*_Row({}, [word for word in row.data if word != ERROR]).hex_bytes()]
    if "I" in row.cells:
        data.insert(0, int(row.cells["I"], 16))
    # 0008 4 00 19 08 08: type 8 (other), sending, place 19h (ACK slot), REC 8, TEC 8.
    kind, direction, place, received, sent = (data + [0] * 5)[:5]
    transmitting = can.ProtocolFlag.TRANSMITTING * (len(data) > 1 and not direction)
    said = bytearray(8)
    said[can.PROTOCOL_BYTE] = _KINDS.get(kind, 0) | transmitting
    said[3], said[can.TEC_BYTE], said[can.REC_BYTE] = place & _SEGMENT, sent, received
    error_class = can.ErrorClass.PROTOCOL | can.ErrorClass.BUS_ERROR
    error_class |= can.ErrorClass.NO_ACK * (place & _SEGMENT == _ACK_SLOT)
    error_class |= can.ErrorClass.COUNTERS * bool(received or sent)
    return can.ErrorFrame(int(error_class), bytes(said))


def _note_status(status: bytes, tally: log_file.LogTally) -> None:
    """Record the errors in a status. 0 means that there is no error."""
    bits = int.from_bytes(status, "big")
    text = next((text for bit, text in _STATUS.items() if bits & bit), None)
    if text is not None:
        tally.errors_told[text] += 1


class TrcLogReader(LineLogReader):
    """A reader of a trace."""

    comments = (";",)
    make_lines = _TrcLines
