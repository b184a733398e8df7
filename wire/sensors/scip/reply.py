r"""What a sensor answers: echo, status, lines of data, an empty line.

>>> Reply(b"BM", "00").encode()
b'BM\n00P\n\n'
>>> ReplySplitter().push(b"BM\n00P\n\n")
[Reply(echo=b'BM', status='00', lines=())]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.wire.errors import FramingError, WireError
from tickrig.wire.sensors.scip.encoding import with_sum, without_sum
from tickrig.wire.sensors.scip.scip1 import OK, SWITCH

END: Final = b"\n\n"
STATUS_BYTES: Final = 2
MOST_BYTES: Final = 16_384
"""No reply is longer: a whole scan has less than 3000 bytes."""


@dataclass(frozen=True, slots=True)
class Reply:
    """One reply.

    Attributes:
        echo: the command, with the scans that remain in the place of their number.
        status: two characters.
        lines: behind the status, as they came, each with its sum.
    """

    echo: bytes
    status: str
    lines: tuple[bytes, ...] = ()

    def encode(self) -> bytes:
        """Return the bytes on the line."""
        return b"\n".join((self.echo, with_sum(self.status.encode()), *self.lines)) + END

    @classmethod
    def parse(cls, data: bytes) -> Reply:
        """Read a reply without its last two line ends.

        Raises:
            FramingError: no echo or status.
            ChecksumError: the sum of the status does not match.
        """
        echo, *rest = data.split(b"\n")
        if not rest:
            raise FramingError(f"{data!r} has no status")
        if (echo, rest) == (SWITCH, [OK]):
            return cls(echo, OK.decode())  # the last answer in SCIP 1.1
        status = without_sum(rest[0])
        if len(status) != STATUS_BYTES or not status.isascii():
            raise FramingError(f"status {status!r} has not 2 characters")
        return cls(echo, status.decode(), tuple(rest[1:]))


@mypyc_attr(serializable=True)
class ReplySplitter:
    """Collects bytes and gives whole replies; chunking makes no difference.

    Attributes:
        garbled: how many replies were none.
    """

    def __init__(self) -> None:
        self._tail = b""
        self.garbled = 0

    def push(self, data: bytes) -> list[Reply]:
        """Take bytes in; give whole replies out."""
        *whole, self._tail = (self._tail + data).split(END)
        if len(self._tail) > MOST_BYTES:
            self._tail, self.garbled = b"", self.garbled + 1
        out = []
        for part in whole:
            try:
                out.append(Reply.parse(part))
            except WireError:
                self.garbled += 1
        return out
