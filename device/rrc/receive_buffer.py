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
    thrown away up to the next LF.

    Attributes:
        size: bytes it holds, line ends included.
        overflows: how often it has overflowed.
        thrown_blocks: how often `size` bytes more of such a line were thrown away.
    """

    size: int
    _lines: deque[bytes] = field(default_factory=deque, init=False)
    _used: int = field(default=0, init=False)
    _begun: bytes = field(default=b"", init=False)
    _thrown: int | None = field(default=None, init=False)  # bytes of the line behind an overflow
    overflows: int = field(default=0, init=False)
    thrown_blocks: int = field(default=0, init=False)

    def __bool__(self) -> bool:
        """Whether a whole line waits."""
        return bool(self._lines)

    def push(self, data: bytes) -> None:
        """Take bytes from the line."""
        *lines, tail = data.split(b"\n")
        for line in lines:
            self._push(line, 1)
            if self._thrown is None:
                self._lines.append(self._begun)
            self._begun, self._thrown = b"", None
        self._push(tail, 0)

    def pop(self) -> bytes:
        """Take the oldest whole line, without its LF."""
        line = self._lines.popleft()
        self._used -= len(line) + 1
        return line

    def _push(self, piece: bytes, end: int) -> None:
        """Append a piece of one line, and its LF if `end` is 1."""
        if self._thrown is None:
            beyond = self._used + len(piece) + end - self.size
            if beyond <= 0:
                self._used += len(piece) + end
                self._begun += piece
                return
            self._lines.clear()
            self._used, self._begun = 0, b""
            self.overflows += 1
            before, piece = 0, piece[len(piece) + end - beyond + 1 :]  # behind the byte too many
        else:
            before = self._thrown
        self._thrown = before + len(piece)
        self.thrown_blocks += self._thrown // self.size - before // self.size


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
