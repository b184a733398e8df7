r"""Text of a CAN log, as `candump -L` writes it and `canplayer` reads it.

>>> line = LogLine(10_000, "vcan0", CanFrame.parse("705#7F"))
>>> str(line)
'(0000000000.010000) vcan0 705#7F'
>>> parse_log(f"{line}\n") == (line,)
True
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.can_fd import FdFrame
from tickrig.wire.errors import WireError

_LINE: Final = re.compile(r"\(([0-9]{1,12})\.([0-9]{6})\) (\S{1,32}) (\S+)(?: [RT])?", re.ASCII)
_ERROR: Final = re.compile(r"[23][0-9A-Fa-f]{7}#.*")  # bit 29: no identifier has it


class CandumpError(ValueError):
    """A line that is none of a CAN log."""


class LogLine(NamedTuple):
    """One frame or error frame of a log.

    Attributes:
        at_us: when it had ended.
        channel: name of the bus, without blanks.
        received: what was on the bus.
    """

    at_us: int
    channel: str
    received: CanFrame | ErrorFrame | FdFrame

    def __str__(self) -> str:
        """Write the line, without LF."""
        seconds, micros = divmod(self.at_us, 1_000_000)
        return f"({seconds:010d}.{micros:06d}) {self.channel} {self.received}"


def parse_line(line: str, number: int = 1) -> LogLine:
    """Read one line; CandumpError if it is none."""
    match = _LINE.fullmatch(line.rstrip())
    if match is None:
        raise CandumpError(
            f"line {number} is not like '(0000000000.010000) vcan0 705#7F': {line!r:.60}"
        )
    seconds, micros, channel, text = match.groups()
    kind: type[CanFrame | ErrorFrame] = ErrorFrame if _ERROR.fullmatch(text) else CanFrame
    try:
        return LogLine(int(seconds) * 1_000_000 + int(micros), channel, kind.parse(text))
    except WireError as error:
        raise CandumpError(f"line {number}: {error}") from error


def parse_log(text: str) -> tuple[LogLine, ...]:
    """Read a log; empty lines are skipped.

    Raises:
        CandumpError: a line that is none.
    """
    lines = enumerate(text.splitlines(), 1)
    return tuple(parse_line(line, number) for number, line in lines if line.strip())
