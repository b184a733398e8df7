"""What both ends of a serial line over TCP want of their connection."""

from __future__ import annotations

import socket
import sys
from typing import Final

KEEP_ALIVE: Final = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}
UNANSWERED_MS: Final = 25_000


def tune(connection: socket.socket) -> None:
    """Send each write at once, and find a machine that vanished 25 s after its last sign.

    Args:
        connection: of TCP.

    Raises:
        OSError: it is gone already, or none of TCP.
    """
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if sys.platform == "linux":
        for name, value in KEEP_ALIVE.items():
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def give_up_unanswered(connection: socket.socket) -> None:
    """End a connection on which something sent has had no answer of the other machine for 25 s.

    Args:
        connection: of TCP.

    Raises:
        OSError: it is gone already, or none of TCP.
    """
    if sys.platform == "linux":
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNANSWERED_MS)
