"""Frames as lines of text, as candump shows them.

>>> lines = DumpLines(Stamp.ZERO)
>>> lines.line(Record(1_000_000, "can0", CanFrame.parse("705#7F")))
' (000.000000)  can0  705   [1]  7F'
>>> lines.line(Record(1_250_000, "can0", CanFrame.parse("185#R5")))
' (000.250000)  can0  185   [5]  remote request'
>>> DumpLines(extra=True).line(Record(0, "can0", FdFrame.parse("185##1AABB")))
'  can0  RX B -  185  [02]  AA BB'

>>> from tickrig.host.canmon.model.decode.decoded import Decoded
>>> from tickrig.host.canmon.model.frames.record import LineRecord
>>> line = LineRecord(1_500_000, "ttyS0", False, b"EV:PowerOn", Decoded("rrc", None, "event"))
>>> line_text(line, "rrc event")
'ttyS0  <  EV:PowerOn                     rrc event'
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final, assert_never

from tickrig.host.canmon.model.frames.record import ARROWS, AnyFrame, Record
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ERROR_FLAG, ErrorFrame
from tickrig.wire.can_fd import FdFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.frames.record import LineRecord

DATA_WIDTH: Final = len("[8]  00 11 22 33 44 55 66 77")


class Stamp(StrEnum):
    """What stands before a frame, as candump's `-t` names it."""

    NONE = ""
    ABSOLUTE = "a"
    DELTA = "d"
    ZERO = "z"
    DATE = "A"


class DumpLines:
    """Writes one line for each frame.

    Identifiers of 11 bits are indented once one of 29 bits was there.

    Args:
        stamp: what stands before a frame.
        extra: show whether the frame was received or sent, with B and E for BRS and ESI.
    """

    def __init__(self, stamp: Stamp = Stamp.NONE, extra: bool = False) -> None:
        self._stamp, self._extra = stamp, extra
        self._first_us: int | None = None
        self._last_us, self._width = 0, 3

    def line(self, record: Record, text: str = "") -> str:
        """Return the line, with what the frame means behind it."""
        ident = _ident(record.frame)
        self._width = max(self._width, len(ident))
        direction = ""
        if self._extra:
            direction = f"  {'TX' if record.sent else 'RX'} {_flags(record.frame)}"
        stamp = self.stamp(record.at_us)
        data = f"{_data(record.frame):<{DATA_WIDTH + 1}}   {text}" if text else _data(record.frame)
        return f"{stamp}  {record.channel}{direction}  {ident:>{self._width}}  {data}"

    def stamp(self, at_us: int) -> str:
        """Return what stands before what was heard at this time."""
        if self._stamp is Stamp.NONE:
            return ""
        if self._first_us is None:
            self._first_us = self._last_us = at_us
        last_us, self._last_us = self._last_us, at_us
        match self._stamp:
            case Stamp.ABSOLUTE:
                return f" ({seconds_text(at_us, 10)})"
            case Stamp.DATE:
                return f" ({date_text(at_us)})"
            case Stamp.ZERO:
                return f" ({seconds_text(at_us - self._first_us, 3)})"
            case Stamp.DELTA:
                return f" ({seconds_text(at_us - last_us, 3)})"
            case _:
                assert_never(self._stamp)


def _flags(frame: AnyFrame) -> str:
    if not isinstance(frame, FdFrame):
        return "- -"
    return f"{'B' if frame.brs else '-'} {'E' if frame.esi else '-'}"


def _ident(frame: AnyFrame) -> str:
    if isinstance(frame, ErrorFrame):
        return f"{ERROR_FLAG | frame.error_class:08X}"
    return f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"


def _data(frame: AnyFrame) -> str:
    """Return length and data; a length of two digits begins a column earlier."""
    data = frame.data.hex(" ").upper()
    if isinstance(frame, CanFrame):
        if frame.remote:
            return f" [{frame.dlc}]  remote request"
        return f" [{len(frame.data)}] {' ' * bool(data)}{data}"
    if isinstance(frame, ErrorFrame):
        return f" [{len(frame.data)}]  {data}   ERRORFRAME"
    return f"[{len(frame.data):02d}] {' ' * bool(data)}{data}"


def seconds_text(span_us: int, digits: int) -> str:
    """Write seconds; a time that runs backwards has a sign."""
    seconds, micros = divmod(abs(span_us), 1_000_000)
    return f"{'-' * (span_us < 0)}{seconds:0{digits}d}.{micros:06d}"


def date_text(at_us: int) -> str:
    """Write a time since the epoch as the local date and time; without a date after 9999."""
    from datetime import datetime  # noqa: PLC0415 - seldom wanted

    seconds, micros = divmod(at_us, 1_000_000)
    try:
        return f"{datetime.fromtimestamp(seconds):%Y-%m-%d %H:%M:%S}.{micros:06d}"
    except (ValueError, OverflowError, OSError):
        return seconds_text(at_us, 10)


def line_text(line: LineRecord, text: str) -> str:
    """Write the line, with what it means behind it."""
    data = bytes_text(line.data)
    shown = f"{data:<{DATA_WIDTH}}   {text}" if text else data
    return f"{line.channel}  {ARROWS[line.sent]}  {shown}"


def decoded_text(decoded: Decoded | None) -> str:
    """Write what a frame means: node, kind, and what it says."""
    if decoded is None or decoded.kind == "raw":
        return ""
    node = "" if decoded.node is None else f"{decoded.node} "
    return f"{node}{decoded.kind} {decoded.text}".rstrip()


def bytes_text(data: bytes) -> str:
    r"""Write bytes as text where they are all printable, else in hex.

    >>> bytes_text(b"SA:64"), bytes_text(b"\x01A")
    ('SA:64', '01 41')
    """
    text = data.decode("latin-1")
    return text if text.isascii() and text.isprintable() else data.hex(" ").upper()
