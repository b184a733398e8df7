"""The input of a monitor: frames and lines of serial ports, with their identifiers and text.

An identifier is one number, which is the CAN-ID with flags above it. The filters of candump apply
to identifiers.

>>> chosen = CandumpFilter.parse("123:7FF,400~700,#FF")
>>> [chosen.passes(ident) for ident in (0x123, 0x400, 0x501, ERROR_FLAG | 0x20, ERROR_FLAG | 0x100)]
[True, False, True, True, False]

The module also writes frames as lines of text, as candump does.

>>> lines = DumpLines(Stamp.ZERO)
>>> lines.line(Record(1_000_000, "can0", CanFrame.parse("705#7F")))
' (000.000000)  can0  705   [1]  7F'
>>> lines.line(Record(1_250_000, "can0", CanFrame.parse("185#R5")))
' (000.250000)  can0  185   [5]  remote request'
>>> DumpLines(extra=True).line(Record(0, "can0", FdFrame.parse("185##1AABB")))
'  can0  RX B -  185  [02]  AA BB'

>>> from tickrig.host.canmon.model.decode.decoded import Decoded
>>> from tickrig.host.canmon.model.frames import LineRecord
>>> line = LineRecord(1_500_000, "ttyS0", False, b"EV:PowerOn", Decoded("rrc", None, "event"))
>>> line_text(line, "rrc event")
'ttyS0  <  EV:PowerOn                     rrc event'
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.text.values import parse_time_us
from tickrig.wire.can import (
    ERROR_CLASS_MASK,
    ERROR_FLAG,
    EXTENDED_MAX,
    MAX_DATA_BYTES,
    CanFrame,
    ErrorFrame,
    FdFrame,
)

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded


# The input of a monitor: frames and lines of serial ports, with their times and places.

ARROWS: Final = {True: ">", False: "<"}
"""Signs for the direction of a line, sent to the device or received from it."""


AnyFrame = CanFrame | ErrorFrame | FdFrame


class Record(NamedTuple):
    """A frame on the bus with its time: a classic CAN frame, a CAN FD frame or an error frame.

    Attributes:
        at_us: time in microseconds at which the frame ended. In logs and on real buses, the time
            counts from the epoch (1970).
        channel: name of the bus, such as `can0`, without blanks.
        frame: the frame itself.
        sent: whether this program sent the frame.
    """

    at_us: int
    channel: str
    frame: AnyFrame
    sent: bool = False


class LineRecord(NamedTuple):
    """A message on a serial line with its time: the counterpart of `Record`, which is a CAN frame.

    A trace can contain both types, and filters accept both.

    Attributes:
        at_us: time of the last byte in microseconds.
        channel: name of the line.
        sent: whether the host sent the message to the device. Otherwise, the device sent it.
        data: bytes of the message, without line end or header.
        decoded: decoded meaning of the message.
    """

    at_us: int
    channel: str
    sent: bool
    data: bytes
    decoded: Decoded

    @property
    def frame(self) -> None:
        """None, because a message is not a CAN frame."""
        return None


AnyRecord = Record | LineRecord
"""An item of a trace of buses and serial lines."""


EXTENDED: Final = 1 << 31
REMOTE: Final = 1 << 30
ERROR: Final = 1 << 29
FD: Final = 1 << 33
"""Flag of CAN FD, which is above the identifier and the flags of struct can_frame."""


def ident_of(frame: CanFrame) -> int:
    """Return the CAN-ID of a frame, with a flag bit for extended and a flag bit for remote frames.

    >>> hex(ident_of(CanFrame.parse("00000605#R")))
    '0xc0000605'
    """
    return frame.can_id | frame.extended << 31 | frame.remote << 30


def fd_ident(frame: FdFrame) -> int:
    """Return the CAN-ID of a CAN FD frame, with a flag bit for extended and a flag bit for CAN FD.

    >>> hex(fd_ident(FdFrame.parse("00000605##1")))
    '0x280000605'
    """
    return frame.can_id | frame.extended << 31 | FD


def any_ident(frame: CanFrame | FdFrame) -> int:
    """Return the CAN-ID with its flags."""
    return fd_ident(frame) if isinstance(frame, FdFrame) else ident_of(frame)


def frame_of(ident: int, dlc: int, payload: int) -> CanFrame | ErrorFrame:
    """Make a frame from numbers.

    Args:
        ident: CAN-ID with the flag bits of `ident_of`. For an error frame: error class with the
            flag `ERROR`.
        dlc: data length code.
        payload: data bytes as one little-endian number.
    """
    data = payload.to_bytes(MAX_DATA_BYTES, "little")
    if ident & ERROR:
        return ErrorFrame(ident & ERROR_CLASS_MASK, data)
    extended = bool(ident & EXTENDED)
    if ident & REMOTE:
        return CanFrame(ident & EXTENDED_MAX, b"", True, extended, dlc)
    return CanFrame(ident & EXTENDED_MAX, data[:dlc], False, extended)


def ident_text(ident: int) -> str:
    """Return the text of an identifier with flags, in candump's notation.

    An R after the CAN-ID marks a remote frame, and a # marks a CAN FD frame.

    >>> ident_text(0x181), ident_text(0xC000_0605), ident_text(FD | 0x181)
    ('181', '00000605R', '181#')
    """
    can_id, mark = ident & EXTENDED_MAX, "R" if ident & REMOTE else "#" if ident & FD else ""
    return (f"{can_id:08X}" if ident & EXTENDED else f"{can_id:03X}") + mark


def parse_ident(text: str) -> int:
    """Parse the text of an identifier, which `ident_text` wrote.

    The result is the CAN-ID with flags. An 11-bit CAN-ID has 3 hex digits, and a 29-bit CAN-ID has
    8.

    Raises:
        ValueError: the text is not an identifier.

    >>> parse_ident("181"), parse_ident("181R") == 0x181 | REMOTE, parse_ident("181#") == 0x181 | FD
    (385, True, True)
    """
    digits = text.removesuffix("R") if text.endswith("R") else text.removesuffix("#")
    most = {3: 0x7FF, 8: EXTENDED_MAX}.get(len(digits))
    if most is None or not set(digits) <= set("0123456789abcdefABCDEF") or int(digits, 16) > most:
        raise ValueError(f"{text!r} is not a CAN-ID: write 3 or 8 hex digits, as 181 or 00000605")
    flags = EXTENDED * (len(digits) == 8) | REMOTE * text.endswith("R") | FD * text.endswith("#")
    return int(digits, 16) | flags


_NODE_BITS: Final = 7
_NODE_MASK: Final = 0x7F

_FUNCTIONS: Final = frozenset([1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14])
"""Function codes that include a node-ID: EMCY, PDO1 to PDO4, SDO, error control."""

_SENDING: Final = frozenset([1, 3, 5, 7, 9, 11, 14])
"""Function codes of these that the node sends: EMCY, TPDO1 to TPDO4, SDO, error control."""


def node_of(ident: int) -> int | None:
    """Return the node-ID that a CAN-ID belongs to in CANopen's predefined connection set.

    The result is None for CAN-IDs without a node-ID. A node whose COB-IDs were configured
    differently may use a CAN-ID that belongs to another node by default.

    >>> node_of(0x181), node_of(0x701), node_of(0x080), node_of(0x7E5)
    (1, 1, None, None)
    """
    can_id = ident & ~REMOTE
    node = can_id & _NODE_MASK
    return node if node and can_id >> _NODE_BITS in _FUNCTIONS else None


def sender_of(ident: int) -> int | None:
    """Return the node-ID of the node that sends a CAN-ID by default in CANopen.

    The result is None for CAN-IDs that no node sends by default. An example is 201h, which node 1
    receives.

    >>> sender_of(0x181), sender_of(0x581), sender_of(0x201), sender_of(0x701 | REMOTE)
    (1, 1, None, None)
    """
    node = ident & _NODE_MASK
    return node if node and ident >> _NODE_BITS in _SENDING else None


_RULE: Final = re.compile(r"([0-9A-Fa-f]{1,8})([:~])([0-9A-Fa-f]{1,8})")
_ERRORS: Final = re.compile(r"#([0-9A-Fa-f]{1,8})")


def flagged_id(record: Record) -> int:
    """Return the identifier with its flags, as in struct can_frame (linux/can.h)."""
    frame = record.frame
    if isinstance(frame, ErrorFrame):
        return ERROR_FLAG | frame.error_class
    return any_ident(frame) & ~FD


@dataclass(frozen=True, slots=True)
class CandumpFilter:
    """A filter of CAN frames in the notation of candump, such as `123:7FF,400~700,#FF`.

    A filter is a list of words between commas. A word such as `123:7FF` is a rule. A frame passes
    if it matches at least one rule. If the filter contains the word `j`, a frame must match all
    rules. If the filter contains no rule, all frames pass. For error frames, only the word `#MASK`
    matters: an error frame passes if the bit of its error class is set in the number MASK.

    Attributes:
        rules: CAN-ID, mask, and whether the rule is inverse, for each rule.
        error_mask: bit mask of the classes of error frames that pass.
        joined: whether a frame must match all rules.
    """

    rules: tuple[tuple[int, int, bool], ...] = ()
    error_mask: int = 0
    joined: bool = False

    @classmethod
    def parse(cls, text: str) -> CandumpFilter:
        """Parse a filter, such as `123:7FF,#FF`.

        The filter is a list of words, separated by commas. `CandumpFilter` describes the words.

        Raises:
            ValueError: a word is not a filter.
        """
        rules, error_mask, joined = [], 0, False
        for word in text.split(","):
            if rule := _RULE.fullmatch(word):
                flag = EXTENDED if len(rule[1]) == 8 else 0
                mask = int(rule[3], 16) & ~ERROR_FLAG
                rules.append((int(rule[1], 16) | flag, mask, rule[2] == "~"))
            elif errors := _ERRORS.fullmatch(word):
                error_mask = int(errors[1], 16)
            elif word in ("j", "J"):
                joined = True
            else:
                raise ValueError(f"{word!r} is no filter like 123:7FF, 400~700 or #FF")
        return cls(tuple(rules), error_mask, joined)

    def passes(self, flagged: int) -> bool:
        """Return whether a frame passes, by its identifier with flags."""
        if flagged & ERROR_FLAG and not flagged & EXTENDED:
            return bool(flagged & self.error_mask & ~ERROR_FLAG)
        held = ((flagged & mask == ident & mask) != inverse for ident, mask, inverse in self.rules)
        return not self.rules or (all(held) if self.joined else any(held))


# Numbers as tables show them: as many digits as a column has room for.


def ms_text(time_us: int | None) -> str:
    """Return a time span in milliseconds as text, or `-` for None.

    The text has at most 8 characters for spans up to 11 days.

    >>> ms_text(None), ms_text(1_234), ms_text(999_999), ms_text(12_345_678)
    ('-', '1.234', '999.999', '12345.7')
    """
    if time_us is None:
        return "-"
    if time_us < 1_000_000:
        return f"{time_us / 1e3:.3f}"
    return f"{time_us / 1e3:.1f}" if time_us < 100_000_000 else f"{time_us // 1_000}"


def s_text(time_us: int) -> str:
    """Return an age in seconds as text. A negative age, of a time in the future, is shown as 0.0.

    >>> s_text(-5), s_text(12_340_000), s_text(123_456_000_000)
    ('0.0', '12.3', '123456')
    """
    return f"{max(0, time_us) / 1e6:.1f}" if time_us < 10_000_000_000 else f"{time_us // 1_000_000}"


def rate_text(per_s: float) -> str:
    """Return a rate as text of at most 7 characters.

    >>> rate_text(0.0), rate_text(9.987), rate_text(12345.6)
    ('0.00', '9.99', '12346')
    """
    return f"{per_s:.2f}" if per_s < 1_000 else f"{per_s:.0f}"


def load_text(bits_s: int, bit_rate: int | None) -> str:
    """Return a bus load as text, in percent of the bit rate, or in bit/s if no bit rate is given.

    >>> load_text(123_456, 1_000_000), load_text(123_456, None)
    ('12.3 %', '123.5 kbit/s')
    """
    if bit_rate is None:
        return f"{bits_s / 1e3:.1f} kbit/s"
    return f"{bits_s * 100 / bit_rate:.1f} %"


def count_text(count: int | None) -> str:
    """Return a count as text, or a dash without a count."""
    return "-" if count is None else str(count)


DATA_WIDTH: Final = len("[8]  00 11 22 33 44 55 66 77")
"""Width of the longest data text. The meaning of a frame starts after it."""


class Stamp(StrEnum):
    """Format of the time before a frame, with the names of candump's `-t`."""

    NONE = ""
    ABSOLUTE = "a"
    DELTA = "d"
    ZERO = "z"
    DATE = "A"


STAMPS: Final = (Stamp.ZERO, Stamp.DELTA, Stamp.ABSOLUTE, Stamp.DATE)
"""Formats in the order in which a key shows them."""


def stamp_text(
    stamp: Stamp, at_us: int, origin_us: int, before_us: int, digits: tuple[int, int] = (1, 1)
) -> str:
    """Return the time of a frame as text, in one of the time formats that candump has.

    Args:
        stamp: format of the time.
        at_us: time to write, in microseconds.
        origin_us: time of the first frame.
        before_us: time of the previous line.
        digits: pair of widths. A width is the minimum number of digits before the decimal point.
            The first width is for absolute times. The second width is for times that count from
            `origin_us` or `before_us`.

    >>> [stamp_text(one, 3_500_000, 1_000_000, 3_000_000) for one in STAMPS[:3]]
    ['2.500000', '0.500000', '3.500000']
    """
    if stamp is Stamp.DATE:
        return date_text(at_us)
    if stamp is Stamp.ABSOLUTE:
        return seconds_text(at_us, digits[0])
    return seconds_text(at_us - (before_us if stamp is Stamp.DELTA else origin_us), digits[1])


class DumpLines:
    """Formatter of the lines that `canmon dump` prints, one line for each frame.

    After the first 29-bit identifier, 11-bit identifiers are indented so that the columns align.

    Args:
        stamp: format of the time at the beginning of each line.
        extra: whether to show the direction (RX or TX), and B and E for the CAN FD bits BRS and
            ESI.

    Attributes:
        form: value of the argument `stamp`.
        first_us: time of the first frame, or None before the first frame.
        last_us: time of the last frame.
        width: width of the identifier column in digits.
    """

    def __init__(self, stamp: Stamp = Stamp.NONE, extra: bool = False) -> None:
        self.form, self.extra = stamp, extra
        self.first_us: int | None = None
        self.last_us, self.width = 0, 3

    def line(self, record: Record, text: str = "") -> str:
        """Return the line of a frame, with the meaning of the frame after it."""
        ident = _ident(record.frame)
        self.width = max(self.width, len(ident))
        direction = ""
        if self.extra:
            direction = f"  {'TX' if record.sent else 'RX'} {_flags(record.frame)}"
        stamp = self.stamp(record.at_us)
        data = f"{_data(record.frame):<{DATA_WIDTH + 1}}   {text}" if text else _data(record.frame)
        return f"{stamp}  {record.channel}{direction}  {ident:>{self.width}}  {data}"

    def around(self, shown: Iterable[tuple[Record, Decoded]], marked: Record | None) -> list[str]:
        """Return the lines of decoded frames around a finding.

        Args:
            shown: frames and their meanings.
            marked: frame of the finding, whose line begins with a mark, or None for no mark.
        """
        return [
            ("  >" if record is marked else "   ") + self.line(record, decoded_text(decoded))
            for record, decoded in shown
        ]

    def stamp(self, at_us: int) -> str:
        """Return the prefix of a line for this time."""
        if self.form is Stamp.NONE:
            return ""
        if self.first_us is None:
            self.first_us = self.last_us = at_us
        last_us, self.last_us = self.last_us, at_us
        return f" ({stamp_text(self.form, at_us, self.first_us, last_us, (10, 3))})"


def _flags(frame: AnyFrame) -> str:
    if not isinstance(frame, FdFrame):
        return "- -"
    return f"{'B' if frame.brs else '-'} {'E' if frame.esi else '-'}"


def _ident(frame: AnyFrame) -> str:
    if isinstance(frame, ErrorFrame):
        return f"{ERROR_FLAG | frame.error_class:08X}"
    return f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"


def _data(frame: AnyFrame) -> str:
    """Return length and data. A length of two digits begins a column earlier."""
    data = frame.data.hex(" ").upper()
    if isinstance(frame, CanFrame):
        if frame.remote:
            return f" [{frame.dlc}]  remote request"
        return f" [{len(frame.data)}] {' ' * bool(data)}{data}"
    if isinstance(frame, ErrorFrame):
        return f" [{len(frame.data)}]  {data}   ERRORFRAME"
    return f"[{len(frame.data):02d}] {' ' * bool(data)}{data}"


def seconds_text(span_us: int, digits: int) -> str:
    """Return seconds as text. A negative time has a sign."""
    seconds, micros = divmod(abs(span_us), 1_000_000)
    return f"{'-' * (span_us < 0)}{seconds:0{digits}d}.{micros:06d}"


DATED_US: Final = 1_000_000_000_000_000
"""Time (September 2001) below which times are no dates, but count from a recorder's start."""


def date_text(at_us: int) -> str:
    """Return a time since the epoch as local date and time.

    A time after the year 9999 is written as seconds since the epoch.
    """
    from datetime import datetime  # noqa: PLC0415 - seldom wanted

    seconds, micros = divmod(at_us, 1_000_000)
    try:
        return f"{datetime.fromtimestamp(seconds):%Y-%m-%d %H:%M:%S}.{micros:06d}"
    except (ValueError, OverflowError, OSError):
        return seconds_text(at_us, 10)


class LogTime(NamedTuple):
    """A point in time in a log, as the user wrote it for an option such as `--from` or `--to`.

    Attributes:
        us: microseconds since the epoch if `dated` is set, otherwise since the first frame of the
            log.
        dated: whether the user gave a date or seconds since the epoch.
        text: the text that the user wrote.
    """

    us: int
    dated: bool
    text: str

    def after(self, first_us: int) -> int:
        """Convert this point in time to microseconds on the clock of a log.

        Args:
            first_us: time of the first frame of the log in microseconds.
        """
        return self.us if self.dated else first_us + self.us


_EPOCH_S: Final = 1_000_000_000
"""Number from which seconds count since the epoch (September 2001). No log is that long."""


def parse_log_time(text: str) -> LogTime:
    """Parse a point in time in a log.

    The text is a span after the first frame, a date, or a number of seconds since the epoch. A date
    without a time zone is in the zone of this machine, in which times are also displayed.

    Raises:
        ValueError: the text has none of these forms.

    >>> parse_log_time("2.5"), parse_log_time("300ms").us
    (LogTime(us=2500000, dated=False, text='2.5'), 300000)
    >>> parse_log_time("2026-11-29T12:00:05.25Z").us, parse_log_time("1795953605.25").us
    (1795953605250000, 1795953605250000)
    """
    seconds = text.strip().removeprefix("(").removesuffix(")")
    if re.fullmatch(r"[0-9]{10,11}(\.[0-9]{1,6})?", seconds):
        whole, _, fraction = seconds.partition(".")
        return LogTime(int(whole) * 1_000_000 + int(f"{fraction:0<6}"), dated=True, text=text)
    if re.match(r"[0-9]{4}-", seconds):
        return LogTime(_date_us(seconds), dated=True, text=text)
    try:
        return LogTime(parse_time_us(seconds), dated=False, text=text)
    except ValueError:
        raise ValueError(
            f"{text!r} is not a time: write 2.5, 300ms after the first frame,"
            " or a date as 2026-11-29 12:00:05.5"
        ) from None


def _date_us(text: str) -> int:
    from datetime import UTC, datetime, timedelta  # noqa: PLC0415 - seldom wanted

    try:
        date = datetime.fromisoformat(re.sub(r" ?UTC$", "+00:00", text)).astimezone()
    except (ValueError, OverflowError, OSError):
        raise ValueError(f"{text!r} is not a date as 2026-11-29 12:00:05.5") from None
    return (date - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1)


def line_text(line: LineRecord, text: str) -> str:
    """Return the line as text, with its meaning after it."""
    data = bytes_text(line.data)
    shown = f"{data:<{DATA_WIDTH}}   {text}" if text else data
    return f"{line.channel}  {ARROWS[line.sent]}  {shown}"


def decoded_text(decoded: Decoded | None) -> str:
    """Return the meaning of a frame as text, with node, kind and content."""
    if decoded is None or decoded.kind == "raw":
        return ""
    node = "" if decoded.node is None else f"{decoded.node} "
    return f"{node}{decoded.kind} {decoded.text}".rstrip()


def bytes_text(data: bytes) -> str:
    r"""Return bytes as text if all are printable, or else in hex.

    >>> bytes_text(b"SA:64"), bytes_text(b"\x01A")
    ('SA:64', '01 41')
    """
    text = data.decode("latin-1")
    return text if text.isascii() and text.isprintable() else data.hex(" ").upper()
