"""A host on a TCP connection that carries the bytes of the line and nothing else."""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import Final

from tickrig.host.links.tcp import tune

READ_BYTES: Final = 1_024
SEND_BUFFER_BYTES: Final = 16_384
"""Of the kernel: what is in it comes late to a host that did not read."""

LAST_WORDS_US: Final = 1_000_000
STUCK_US: Final = 30_000_000


class HostConnection:
    """A host on a plain connection; nothing here ever waits for it.

    What it does not read is kept up to `buffer_bytes`; after that whole sends are dropped
    and counted, as on a pty. A host that sends no more, but may still read, as `nc` at the
    end of its input, is given what comes within a second.

    Args:
        connection: to the host.
        buffer_bytes: bytes kept for a host that does not read.

    Attributes:
        connection: to the host.
        over: the host has gone, or was hung up on.
        mistake: why it has to be left, if it sent what cannot be understood.
        is_idle: nothing of it was waiting at the latest look.
        lost: bytes dropped because it did not read.
    """

    def __init__(self, connection: socket.socket, buffer_bytes: int) -> None:
        self.connection, self._buffer_bytes = connection, buffer_bytes
        self._unsent, self._held = bytearray(), b""
        self._stuck_us: int | None = None
        self._last_words_us: int | None = None
        self.over, self.mistake, self.is_idle, self.lost = False, "", True, 0
        connection.setblocking(False)
        with suppress(OSError):  # gone already, or no TCP: the ends of a pair, in tests
            _tune(connection)

    @property
    def setting(self) -> str:
        """What it has set the port to, as `9600 8N1`; empty where it cannot."""
        return ""

    def has_ended(self, now_us: int) -> bool:
        """Whether another host may have the line: this one sends no more, or is stuck."""
        stuck = self._stuck_us is not None and now_us - self._stuck_us >= STUCK_US
        return self.over or stuck or self._last_words_us is not None

    def poll(self, now_us: int) -> bytes:
        """Take some of what it sent; what was held comes first."""
        if not self._held:
            return self._look(now_us)
        data, self._held, self.is_idle = self._held, b"", False
        if self._last_words_us is not None:  # it is answered from now on
            self._last_words_us = now_us + LAST_WORDS_US
        return data

    def hold(self, now_us: int) -> None:
        """Negotiate while another host has the line, and keep some of what it sends."""
        if len(self._held) < READ_BYTES and not self.has_ended(now_us):
            self._held += self._look(now_us)
        self.over |= self.has_ended(now_us) and not self._held  # it has not waited

    def send(self, now_us: int, traffic: bytes) -> None:
        """Send as much as fits, and keep the rest for later."""
        if len(self._unsent) + len(traffic) > self._buffer_bytes:
            self.lost += len(traffic)
        else:
            self._unsent += self._give_out(traffic)
        self.flush(now_us)

    def flush(self, now_us: int) -> None:
        """Send of what is kept as much as fits."""
        sent = 0
        try:
            if self._unsent and not self.over:
                sent = self.connection.send(self._unsent)
        except BlockingIOError:
            pass
        except OSError:
            self.over = True
        del self._unsent[:sent]
        if sent or not self._unsent:
            self._stuck_us = None
        elif self._stuck_us is None:
            self._stuck_us = now_us

    def close(self) -> None:
        """Hang up."""
        self.over = True
        self.connection.close()

    @property
    def _may_read(self) -> bool:
        """Whether there is room for what reading may bring forth."""
        return True

    def _take_in(self, data: bytes) -> bytes:
        """Return what of it is for the device."""
        return data

    def _give_out(self, traffic: bytes) -> bytes:
        """Return how it is sent to the host."""
        return traffic

    def _look(self, now_us: int) -> bytes:
        """Take some of what comes."""
        self.flush(now_us)
        self.is_idle = True
        if self._last_words_us is not None:
            self.over |= now_us >= self._last_words_us
        if self.over or self._last_words_us is not None or not self._may_read:
            return b""
        return self._take_in(self._read(now_us))

    def _read(self, now_us: int) -> bytes:
        try:
            data = self.connection.recv(READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            self.over = True
            return b""
        self.is_idle = False
        if not data:
            self._last_words_us = now_us + LAST_WORDS_US
        return data


def _tune(connection: socket.socket) -> None:
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
    tune(connection)
