"""One line of a log in text: candump's, an object in JSON, a row of CSV, a line of a screen.

Beyond what `candump -L` writes at present it reads what others write in its name:
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

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.reading.csv_line import parse_csv_line
from tickrig.host.monitor.logs.reading.frame_notation import parse_frame
from tickrig.host.monitor.logs.reading.json_line import parse_json_line
from tickrig.host.monitor.logs.reading.screen_line import ScreenClock, parse_screen_line
from tickrig.host.monitor.logs.tally import CAN_FD, CAN_XL, Tally
from tickrig.wire.errors import WireError

COMMENTS: Final = ("#", ";", "//")

_LINE: Final = re.compile(
    r"\(([0-9]{1,12})\.([0-9]{1,9})\)\s+(\S{1,32})\s+(\S+)(?:\s+([RT]))?", re.ASCII
)
_FD: Final = re.compile(r"(?:[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})##[0-9A-Fa-f](?:[0-9A-Fa-f]{2}){0,64}")
_XL: Final = re.compile(r"[0-9A-Fa-f]{5}#[0-9A-Fa-f:]{14}#(?:[0-9A-Fa-f]{2})+")


def parse_log_line(
    line: str, number: int, tally: Tally, clock: ScreenClock | None = None
) -> Heard | None:
    """Read a line; None if it holds no frame, and then the tally says why.

    Empty lines and comments (`#`, `;`, `//`) hold none, and are no fault.

    Args:
        line: without its LF.
        number: of the line, from 1.
        tally: takes what was no frame.
        clock: of the lines of a screen.
    """
    text = line.strip()
    if not text or text.startswith(COMMENTS):
        return None
    heard = _parsed(line, text, tally, clock or ScreenClock())
    if heard is None:
        tally.bad_lines.add(number, line.rstrip("\r"))
    return heard if isinstance(heard, Heard) else None


def _parsed(line: str, text: str, tally: Tally, clock: ScreenClock) -> Heard | str | None:
    """Return a frame, what was counted instead, or None for a bad line."""
    if text.startswith("{"):
        return parse_json_line(text, tally)
    if match := _LINE.fullmatch(text):
        return _logged(match, tally)
    return parse_screen_line(line, tally, clock) or parse_csv_line(text, tally)


def _logged(match: re.Match[str], tally: Tally) -> Heard | str | None:
    """Return what a line of `candump -L` says."""
    seconds, fraction, channel, notation, direction = match.groups()
    for kind, pattern in ((CAN_FD, _FD), (CAN_XL, _XL)):
        if pattern.fullmatch(notation):
            tally.passed_over[kind] += 1
            return kind
    at_us = int(seconds) * 1_000_000 + int(f"{fraction:0<6.6}")
    try:
        return Heard(at_us, channel, parse_frame(notation), direction == "T")
    except WireError:
        return None
