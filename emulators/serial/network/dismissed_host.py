"""A host that was told to leave."""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import Final

LEAVING_US: Final = 1_000_000
READ_BYTES: Final = 65_536


class DismissedHost:
    """A host that is told why it cannot stay, and has a second to read it.

    A connection that is closed while its host still sends is reset, and some systems then drop
    what the host had not read yet. So what comes is read, and dropped.

    Args:
        connection: to the host.
        now_us: the time.
        reason: a line of text.
    """

    def __init__(self, connection: socket.socket, now_us: int, reason: str) -> None:
        self._connection, self._until_us = connection, now_us + LEAVING_US
        connection.setblocking(False)
        with suppress(OSError):  # gone already
            connection.send(f"{reason}\r\n".encode())
            connection.shutdown(socket.SHUT_WR)

    def is_gone(self, now_us: int) -> bool:
        """Hang up if the host has, or if its time is over; return whether it is gone."""
        try:
            gone = not self._connection.recv(READ_BYTES)
        except BlockingIOError:
            gone = False
        except OSError:
            gone = True
        if gone or now_us >= self._until_us:
            self.close()
            return True
        return False

    def close(self) -> None:
        """Hang up."""
        self._connection.close()
