"""What comes over the line: bytes that wait, lines, commands and refusals."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from tickrig.wire.errors import ChecksumError
from tickrig.wire.rrc.check import strip_check
from tickrig.wire.rrc.commands import BadParameters, Command, UnknownCommand, parse_command
from tickrig.wire.rrc.replies import COMMAND_CHECKSUM, COMMAND_UNKNOWN, Refusal


@dataclass(slots=True)
class ReceiveBuffer:
    """Bytes that wait to be worked on, cut into lines (DECISION R27).

    The byte that does not fit drops all that waits; it and what follows are
    ignored up to the next LF.

    Attributes:
        size: bytes it holds, line ends included.
    """

    size: int
    _lines: deque[bytes] = field(default_factory=deque, init=False)
    _used: int = field(default=0, init=False)
    _begun: bytes = field(default=b"", init=False)
    _ignoring: bool = field(default=False, init=False)

    def __bool__(self) -> bool:
        """Whether a whole line waits."""
        return bool(self._lines)

    def push(self, data: bytes) -> int:
        """Take bytes from the line; return how often the buffer overflowed."""
        overflows = 0
        *lines, tail = data.split(b"\n")
        for line in lines:
            overflows += self._push(line + b"\n")
            if not self._ignoring:
                self._lines.append(self._begun[:-1])
            self._begun, self._ignoring = b"", False
        return overflows + self._push(tail)

    def pop(self) -> bytes:
        """Take the oldest whole line, without its LF."""
        line = self._lines.popleft()
        self._used -= len(line) + 1
        return line

    def _push(self, piece: bytes) -> bool:
        """Append a piece of one line; True if that was too much."""
        if self._ignoring:
            return False
        if self._used + len(piece) > self.size:
            self._lines.clear()
            self._used, self._begun, self._ignoring = 0, b"", True
            return True
        self._used += len(piece)
        self._begun += piece
        return False


def read_line(line: bytes, *, check_wanted: bool) -> Command | Refusal | None:
    """Return what a line without LF asks for, its refusal (DECISION R11), or None if empty."""
    message = line.removesuffix(b"\r")
    if not message:
        return None
    try:
        return parse_command(strip_check(message) if check_wanted else message)
    except ChecksumError:
        return Refusal(COMMAND_CHECKSUM)
    except UnknownCommand:
        return Refusal(COMMAND_UNKNOWN)
    except BadParameters as error:
        return Refusal(error.name.decode())
