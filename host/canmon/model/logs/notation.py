r"""Frames as lines of JSON and CSV, and in candump's compact notation.

>>> csv_row(Record(1_500_000, "can0", can.CanFrame(0x705, b"\x7f"), sent=True))
'1.500000,0x705,0,0,0,1,fw==>'

>>> str(parse_frame("123#0011223344556677_C")), str(parse_frame("20000080#01"))
('123#0011223344556677', '20000080#0100000000000000')
"""

from __future__ import annotations

import re
from binascii import a2b_base64, b2a_base64
from typing import Any, Final, Protocol

from tickrig.host.canmon.model.frames import AnyFrame, LineRecord, Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.wire import can
from tickrig.wire.errors import WireError

_CODED: Final = re.compile(r"(.+#(?:[0-9A-Fa-f]{16}|R8))_[9A-Fa-f]")
_ERROR: Final = re.compile(r"([23][0-9A-Fa-f]{7})#((?:[0-9A-Fa-f]{2}){0,8})")


def parse_frame(notation: str) -> AnyFrame:
    """Parse a frame in candump notation, such as `123#DEADBEEF`.

    A suffix such as `_9`, the raw DLC of a frame with eight data bytes, is ignored. An error frame
    may have fewer than eight bytes.

    Raises:
        WireError: the text is not a valid frame.
    """
    if error := _ERROR.fullmatch(notation):
        data = bytes.fromhex(error[2]).ljust(8, b"\0")
        return can.ErrorFrame(int(error[1], 16) & can.ERROR_CLASS_MASK, data)
    coded = _CODED.fullmatch(notation)
    return can.parse_sent(coded[1] if coded else notation)


LONGEST_NAME: Final = 32
"""Number of characters of a bus name, as in the lines of a candump log."""
_NAME: Final = re.compile(rf"\S{{1,{LONGEST_NAME}}}", re.ASCII)

_VERSION: Final = 1
_LINE_EVENT: Final = "line"
"""Name of the event for a line of a serial port, which no CAN log holds."""


def json_line(record: Record, more: str = "") -> str:
    """Return a frame as one line of JSON, the format of JSONL logs and of `--jsonl`.

    A frame is an object with `v`, `t` (seconds), `ch`, `id`, `x` (1: extended), `dir` and `data`
    (hex). A remote frame has `rtr`, which is its length. An error frame has `err`: 1, and its class
    as `id`. A CAN FD frame has `fd`: 1, and `brs`: 1 and `esi`: 1 if these bits are set. `more`
    contains further members, each with a comma before it.

    This function writes only frames. A JSONL log also has lines for events, with the member `ev`.
    For example, `{"v":1,"ev":"drop","n":12}` reports lost frames. The text that a serial port
    receives or sends is also written as events.

    >>> json_line(Record(1_500_000, "can0", can.CanFrame(0x185, b"7")))
    '{"v":1,"t":1.500000,"ch":"can0","id":389,"x":0,"dir":"rx","data":"37"}'
    """
    at_us, channel, frame, sent = record
    if isinstance(frame, can.ErrorFrame):
        what = f'"id":{frame.error_class},"x":0,"err":1'
    elif isinstance(frame, can.FdFrame):
        flags = ',"brs":1' * frame.brs + ',"esi":1' * frame.esi
        what = f'"id":{frame.can_id},"x":{frame.extended:d},"fd":1{flags}'
    else:
        remote = f',"rtr":{frame.dlc}' if frame.remote else ""
        what = f'"id":{frame.can_id},"x":{frame.extended:d}{remote}'
    return (
        f'{{"v":{_VERSION},"t":{at_us // 1_000_000}.{at_us % 1_000_000:06d},'
        f'"ch":{_quoted(channel)},'
        f'{what},"dir":"{"tx" if sent else "rx"}","data":"{frame.data.hex().upper()}"{more}}}'
    )


def line_json(line: LineRecord, more: str = "") -> str:
    """Return a message of a serial line as one line of JSON, in the form of an event (`ev`).

    `more` contains further members, each with a comma before it.

    >>> from tickrig.host.canmon.model.decode.decoded import Decoded
    >>> line_json(LineRecord(1_500_000, "ttyS0", False, b"EV:PowerOn", Decoded("rrc")))
    '{"v":1,"ev":"line","t":1.500000,"ch":"ttyS0","dir":"rx","data":"45563A506F7765724F6E"}'
    """
    at_us = line.at_us
    return (
        f'{{"v":{_VERSION},"ev":"{_LINE_EVENT}","t":{at_us // 1_000_000}.{at_us % 1_000_000:06d},'
        f'"ch":{_quoted(line.channel)},"dir":"{"tx" if line.sent else "rx"}",'
        f'"data":"{line.data.hex().upper()}"{more}}}'
    )


def drop_line(lost: int) -> str:
    """Return a line that reports lost frames.

    >>> drop_line(12)
    '{"v":1,"ev":"drop","n":12}'
    """
    return f'{{"v":{_VERSION},"ev":"drop","n":{lost}}}'


def parse_json_line(text: str, tally: log_file.LogTally) -> Record | str | None:
    """Parse one line of a JSON log.

    The result is a frame, the name of an event, or None for an invalid line.
    """
    import json  # noqa: PLC0415 - candump's lines are the usual ones

    try:
        said = json.loads(text)
        if "ev" in said:
            return _event(said, tally)
        return Record(
            log_file.to_us(said["t"]), _name(said["ch"]), _frame(said), said.get("dir") == "tx"
        )
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError, WireError):
        return None


def _event(said: dict[str, Any], tally: log_file.LogTally) -> str:
    """Read an event. An unknown event has no meaning."""
    if said["ev"] == log_file.DROP:
        tally.lost += max(0, int(said["n"]))
    elif said["ev"] == _LINE_EVENT:
        tally.pass_over(log_file.SERIAL_LINES)
    return str(said["ev"])


def _name(channel: object) -> str:
    name = str(channel)
    if not _NAME.fullmatch(name):
        raise ValueError(f"channel {name!r} is not a name of 1 to 32 characters without blanks")
    return name


def _frame(said: dict[str, Any]) -> AnyFrame:
    data = bytes.fromhex(said["data"])
    if said.get("err"):
        return can.ErrorFrame(int(said["id"]) & 0x1FFF_FFFF, data[:8].ljust(8, b"\0"))
    if said.get("fd"):
        flags = can.BRS * bool(said.get("brs")) | can.ESI * bool(said.get("esi"))
        return can.FdFrame(int(said["id"]), data, bool(said["x"]), flags).checked()
    remote = said.get("rtr")
    frame = can.CanFrame(
        int(said["id"]), data, remote is not None, bool(said["x"]), int(remote or 0)
    )
    return frame.checked()


def _quoted(text: str) -> str:
    """Quote a name. Nearly all names need no escapes."""
    if text.isascii() and text.isprintable() and '"' not in text and "\\" not in text:
        return f'"{text}"'
    import json  # noqa: PLC0415 - slow

    return json.dumps(text)


LOG_HEADER: Final = "timestamp,arbitration_id,extended,remote,error,dlc,data"
DUMP_HEADER: Final = "t,ch,id,dir,dlc,data,kind,node,text"
UNNAMED: Final = "can0"
"""Name of a bus without a name or number."""

_SENT: Final = ">"
FD, FD_BRS, FD_ESI = "#", "!", "*"
"""Signs after the data of a row, which base64 does not use."""


class _Counting(Protocol):
    """Clock that returns the time for a counter of microseconds.

    Attributes:
        shift_us: offset added to the counter.
    """

    shift_us: int

    def counted_us(self, count: int) -> int:
        """Return microseconds of at least 0."""


_DUMPED: Final = re.compile(
    r"([0-9]{1,12}\.[0-9]{6}),([^,\"\s]{1,32}),([0-9A-Fa-f]*),([rt]x),[0-9]+,"
    r"(R[0-8]?|#?[0-9A-Fa-f]*),.*"
)


def csv_row(record: Record) -> str:
    """Return a frame as a row of a CSV log, in the format of python-can with additions.

    The format of python-can contains neither the direction of a frame nor CAN FD. This function
    adds signs after the data. The sign `>` marks a frame that this program sent. The sign `#` marks
    a CAN FD frame, `!` marks BRS, and `*` marks ESI. python-can ignores these signs.
    """
    at_us, _, frame, sent = record
    marks = _SENT * sent
    if isinstance(frame, can.ErrorFrame):
        what = f"{frame.error_class:#x},0,0,1,{len(frame.data)}"
    elif isinstance(frame, can.FdFrame):
        what = f"{frame.can_id:#x},{frame.extended:d},0,0,{len(frame.data)}"
        marks = FD + FD_BRS * frame.brs + FD_ESI * frame.esi + marks
    else:
        what = f"{frame.can_id:#x},{frame.extended:d},{frame.remote:d},0,{frame.dlc}"
    data = b2a_base64(frame.data, newline=False).decode("ascii")
    return f"{at_us // 1_000_000}.{at_us % 1_000_000:06d},{what},{data}{marks}"


_GVRET_BYTES: Final = 8
"""Number of data columns, whatever the length is."""
_WITHOUT_ERRORS: Final = "a GVRET log holds no error frames"

_GVRET_HEAD: Final = re.compile(r"time stamp,\s*id,\s*extended,.*", re.IGNORECASE)
_GVRET: Final = re.compile(
    r"(-?[0-9]{1,18}),\s*([0-9A-F]{1,8}),\s*(true|false),(?:\s*(Rx|Tx),)?\s*([0-9]{1,3}),"
    r"\s*([0-9]{1,2})((?:,\s*[0-9A-F]{1,2})*)(?:,\s*)*",
    re.ASCII | re.IGNORECASE,
)


def gvret_row(record: Record, bus: int) -> str:
    """Return a data frame of at most 8 bytes as a row below `GVRET_HEADER`.

    >>> gvret_row(Record(1_500_000, "can0", can.CanFrame(0x705, b"7"), sent=True), 0)
    '1500000,00000705,false,Tx,0,1,37,00,00,00,00,00,00,00,'
    """
    frame = record.frame
    assert isinstance(frame, can.CanFrame), "the log holds no others"
    direction = "Tx" if record.sent else "Rx"
    cells = frame.data.ljust(_GVRET_BYTES, b"\0").hex(",").upper()
    extended = "true" if frame.extended else "false"
    head = f"{record.at_us},{frame.can_id:08X},{extended},{direction},{bus}"
    return f"{head},{len(frame.data)},{cells},"


def parse_csv_line(text: str, tally: log_file.LogTally, clock: _Counting) -> Record | str | None:
    """Parse a row of a CSV log, which python-can, `canmon dump --csv` or SavvyCAN wrote.

    The row itself shows which of these formats it has. For a row with a frame, the result is the
    frame. For a header, or another item without a frame, the result is a text. For an invalid row,
    the result is None.
    """
    if text.startswith((LOG_HEADER, DUMP_HEADER)) or _GVRET_HEAD.fullmatch(text):
        return text
    try:
        if match := _DUMPED.fullmatch(text):
            return _dumped(match, tally)
        if match := _GVRET.fullmatch(text):
            return _of_savvycan(match, tally, clock)
        return _logged(text.split(","))
    except (ValueError, WireError):
        return None


def _of_savvycan(match: re.Match[str], tally: log_file.LogTally, clock: _Counting) -> Record:
    """Return the frame of a row. Some programs do not mark 29-bit CAN-IDs."""
    stamp, ident, extended, direction, bus, length, cells = match.groups()
    can_id, size = int(ident, 16), int(length)
    data = bytes(int(cell, 16) for cell in cells.split(",")[1 : size + 1])
    if len(data) != size:
        raise ValueError(f"{len(data)} bytes, {size} were announced")
    long = extended.lower() == "true" or can_id > can.STANDARD_MAX
    fd = size > can.MAX_DATA_BYTES
    frame = can.FdFrame(can_id, data, long) if fd else can.CanFrame(can_id, data, False, long)
    checked = frame.checked()
    tally.without_errors = _WITHOUT_ERRORS
    at_us = clock.counted_us(int(stamp))
    tally.shifted_us = clock.shift_us
    return Record(at_us, f"can{int(bus)}", checked, (direction or "").lower() == "tx")


def _dumped(match: re.Match[str], tally: log_file.LogTally) -> Record | str:
    stamp, channel, ident, direction, data = match.groups()
    if not ident:
        return tally.pass_over(log_file.SERIAL_LINES)
    return Record(
        log_file.to_us(float(stamp)), channel, parse_frame(f"{ident}#{data}"), direction == "tx"
    )


def _logged(cells: list[str]) -> Record:
    stamp, ident, extended, remote, error, dlc, text = cells
    data, can_id, length = a2b_base64(text), int(ident, 16), int(dlc)
    frame: AnyFrame
    if error == "1":
        frame = can.ErrorFrame(can_id & can.ERROR_CLASS_MASK, data[:8].ljust(8, b"\0"))
    elif remote == "1":
        frame = can.CanFrame(can_id, b"", True, extended == "1", length).checked()
    elif FD in text or (len(data) > can.MAX_DATA_BYTES and len(data) in can.FD_LENGTHS):
        flags = can.BRS * (FD_BRS in text) | can.ESI * (FD_ESI in text)
        frame = can.FdFrame(can_id, data, extended == "1", flags).checked()
    else:
        frame = can.CanFrame(can_id, data, False, extended == "1").checked()
    return Record(log_file.to_us(float(stamp)), UNNAMED, frame, text.rstrip().endswith(_SENT))
