"""One line of a log in text: candump's, or an object in JSON.

Beyond what candump writes at present it reads what others write in its name:
stamps in nanoseconds or with fewer digits, a direction behind the frame, the raw
length code behind eight bytes, error frames with less than eight bytes.

>>> tally = Tally()
>>> heard = parse_log_line("(0.01) vcan0 705#7F T", 1, tally)
>>> heard.at_us, heard.channel, str(heard.frame), heard.sent
(10000, 'vcan0', '705#7F', True)
>>> parse_log_line("(0000000000.020000) vcan0 123##1AABB", 2, tally), tally.passed_over
(None, Counter({'CAN FD frames': 1}))
"""

from __future__ import annotations

import re
from typing import Final

from tickrig.host.monitor.heard import Heard
from tickrig.host.monitor.logs.json_line import parse_json_line
from tickrig.host.monitor.logs.tally import Tally
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame
from tickrig.wire.errors import WireError

COMMENTS: Final = ("#", ";", "//")

CAN_FD: Final = "CAN FD frames"
CAN_XL: Final = "CAN XL frames"

_LINE: Final = re.compile(
    r"\(([0-9]{1,12})\.([0-9]{1,9})\)\s+(\S{1,32})\s+(\S+)(?:\s+([RT]))?", re.ASCII
)
_CODED: Final = re.compile(r"(.+#(?:[0-9A-Fa-f]{16}|R8))_[9A-Fa-f]")
_ERROR: Final = re.compile(r"([23][0-9A-Fa-f]{7})#((?:[0-9A-Fa-f]{2}){0,8})")
_FD: Final = re.compile(r"(?:[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})##[0-9A-Fa-f](?:[0-9A-Fa-f]{2}){0,64}")
_XL: Final = re.compile(r"[0-9A-Fa-f]{5}#[0-9A-Fa-f:]{14}#(?:[0-9A-Fa-f]{2})+")


def parse_log_line(line: str, number: int, tally: Tally) -> Heard | None:
    """Read a line; None if it holds no frame, and then the tally says why.

    Empty lines and comments (`#`, `;`, `//`) hold none, and are no fault.
    """
    text = line.strip()
    if not text or text.startswith(COMMENTS):
        return None
    parse = parse_json_line if text.startswith("{") else _parse_candump
    heard = parse(text, tally)
    if heard is None:
        tally.bad_lines.add(number, line.rstrip("\r"))
    return heard if isinstance(heard, Heard) else None


def _parse_candump(text: str, tally: Tally) -> Heard | str | None:
    """Return a frame, what was counted instead, or None for a bad line."""
    match = _LINE.fullmatch(text)
    if match is None:
        return None
    seconds, fraction, channel, notation, direction = match.groups()
    for kind, pattern in ((CAN_FD, _FD), (CAN_XL, _XL)):
        if pattern.fullmatch(notation):
            tally.passed_over[kind] += 1
            return kind
    at_us = int(seconds) * 1_000_000 + int(f"{fraction:0<6.6}")
    try:
        return Heard(at_us, channel, _parse_frame(notation), direction == "T")
    except WireError:
        return None


def _parse_frame(notation: str) -> CanFrame | ErrorFrame:
    if error := _ERROR.fullmatch(notation):
        data = bytes.fromhex(error[2]).ljust(8, b"\0")
        return ErrorFrame(int(error[1], 16) & ERROR_CLASS_MASK, data)
    coded = _CODED.fullmatch(notation)
    return CanFrame.parse(coded[1] if coded else notation)
