r"""Bytes that come in pieces, cut behind their last LF.

>>> lines = WholeLines()
>>> lines.push(b"one\ntw"), lines.push(b"o"), lines.push(b"\n"), lines.finish()
(b'one\n', b'', b'two\n', b'')
"""

from __future__ import annotations

from typing import Final

LONGEST: Final = 1 << 20
"""Bytes; of a longer line the beginning is kept, and no line of a log is so long."""


class WholeLines:
    """Holds back a line that has begun, in time and memory that do not grow with its pieces."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._held = 0

    def push(self, data: bytes, /) -> bytes:
        """Return the lines that end in these bytes, each with its LF."""
        lines, end, rest = data.rpartition(b"\n")
        if not end:
            self._hold(rest)
            return b""
        whole = b"".join((*self._pieces, lines, end))
        self._pieces, self._held = [], 0
        self._hold(rest)
        return whole

    def finish(self) -> bytes:
        """Return a last line without LF."""
        rest = b"".join(self._pieces)
        self._pieces, self._held = [], 0
        return rest

    def _hold(self, rest: bytes) -> None:
        if self._held < LONGEST:
            self._pieces.append(rest)
            self._held += len(rest)
