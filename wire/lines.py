"""Split a byte stream into LF-terminated lines."""

from __future__ import annotations

from tickrig._compiled import mypyc_attr


@mypyc_attr(serializable=True)
class LineSplitter:
    r"""Splits a stream of received bytes into lines. The bytes may arrive in any chunks.

    Args:
        max_bytes: largest number of bytes of a line. A longer line is returned in pieces, so that
            noise without LF cannot fill the memory.

    >>> splitter = LineSplitter()
    >>> splitter.push(b"OK:be"), splitter.push(b"ep\r\nEV:")
    ([], [b'OK:beep'])
    """

    def __init__(self, max_bytes: int = 1_024) -> None:
        self._tail = b""
        self._max_bytes = max_bytes

    def push(self, data: bytes) -> list[bytes]:
        """Add received bytes, and return the lines that they complete.

        Args:
            data: the received bytes.

        Returns:
            The completed lines, without LF and without one CR before the LF.
        """
        *lines, tail = (self._tail + data).split(b"\n")
        out = []
        for line in lines:
            *pieces, last = self._pieces(line)
            out += [*pieces, last.removesuffix(b"\r")]
        *pieces, self._tail = self._pieces(tail)
        return out + pieces

    def _pieces(self, line: bytes) -> list[bytes]:
        size = self._max_bytes
        return [line[at : at + size] for at in range(0, max(1, len(line)), size)]

    def clear(self) -> None:
        """Discard an incomplete line."""
        self._tail = b""
