"""A server for a control socket."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

from tickrig.host.control.requests import RequestDispatcher, refusal_line
from tickrig.host.control.unix_socket import listen_at
from tickrig.host.links.ready import ready

# Theory of operation
# ===================
#
# The server has no thread and no loop of its own. Who runs the emulator gives it time:
# `serve(wait_us)` does one round and returns. A clock in real time (`ServingClock`) calls
# it in place of sleeping, so a request is answered between two ticks and never inside one:
# a verb may touch the rig freely.
#
# One round, in this order: answers that were left over go out, bytes come in, attached
# sources run, each client has one line answered, one new client is accepted. One line a
# round keeps a client that sends a thousand from holding up the others and the tick.
# Bounds, all of them constants:
#
# - a line longer than `MAX_LINE` is refused while it comes, and thrown away up to its end;
# - a client with `MAX_UNSENT` bytes unread is not answered and so not read from
#   (`wants_more` is false while a line waits): back-pressure, and the memory for a client
#   is bounded;
# - 32 clients; where all places are taken the one that has been silent longest goes, after
#   60 s.
#
# A line is found once (`_end`), from where the last search ended, or a client that sends a
# long line byte by byte would cost the square of it.
#
# A client is closed when its last answer has left and not when it hangs up its half: `echo
# ... | nc -N` sends and closes at once, and still gets its answer. `gone` is judged after
# `_answer` only.
#
# The socket appears under its path when it already listens (unix_socket.py), and disappears
# only if the path still is the inode of this server: another one may have taken its place.

# Lines and their answers over a listening socket: many clients, no thread, bounded work.

MAX_LINE: Final = 4_096
MAX_CLIENTS: Final = 32
MAX_UNSENT: Final = 262_144
_READ_BYTES: Final = 4_096
IDLE_S: Final = 60.0
"""Idle time after which a client makes room for another client if all places are taken."""

Answer = Callable[[bytes], bytes]
"""Function that answers a line. The line has no line end, and the answer has a line end."""


class _Readable(Protocol):
    """An object with a descriptor, such as a socket, for `select`."""

    def fileno(self) -> int:
        """Return the descriptor."""
        ...


class LineServer:
    """Server that answers lines of text from many clients, without threads.

    The server works only during calls of `serve`. In each round, it answers at most one line of
    each client. If a client does not read its answers, the server stops reading the requests of
    this client.

    Args:
        listener: non-blocking listening socket, which the server closes.
        begin: function that is called for each new client. It returns the function that answers the
            lines of this client.
        refuse: function that returns the answer for a refused line, given the reason.
        max_line: maximum length of a line in bytes.
        clock: function that returns a monotonic time in seconds.
    """

    def __init__(
        self,
        listener: socket.socket,
        begin: Callable[[], Answer],
        refuse: Callable[[str], bytes],
        max_line: int = MAX_LINE,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._listener, self._begin, self._refuse = listener, begin, refuse
        self._max_line, self._clock = max_line, clock
        self._clients: dict[socket.socket, _Client] = {}
        self._attached: dict[_Readable, Callable[[], None]] = {}

    def attach(self, source: _Readable, ready: Callable[[], None]) -> None:
        """Make `serve` also wait for another source, and call a function when the source has data.

        Args:
            source: object with a file descriptor. A descriptor of -1 shows that the source is
                closed.
            ready: function that `serve` calls when there is data to read.
        """
        self._attached[source] = ready

    def serve(self, wait_us: int) -> None:
        """Serve the clients once, after a wait of at most `wait_us` for work."""
        clients = self._clients.values()
        readers = [client.connection for client in clients if client.wants_more]
        writers = [client.connection for client in clients if client.has_unsent]
        # A second line of a client is already here; no descriptor will announce it.
        wait_us = 0 if any(client.has_line for client in clients) else max(0, wait_us)
        attached = [source for source in self._attached if source.fileno() >= 0]
        sources = [self._listener, *readers, *attached]
        can_be_read, can_be_written = ready(sources, writers, wait_us / 1e6)
        for connection in can_be_written:
            self._clients[connection].flush()
            self._clients[connection].active_s = self._clock()
        for connection in readers:
            if connection in can_be_read:
                self._clients[connection].read()
                self._clients[connection].active_s = self._clock()
        for source in attached:
            if source in can_be_read:
                self._attached[source]()
        self._answer()
        if self._listener in can_be_read:
            self._accept()

    def close(self) -> None:
        """Send pending data, and close the connections."""
        for client in self._clients.values():
            client.flush()
            client.connection.close()
        self._clients.clear()
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:  # the client is gone again, or no descriptor is left
            return
        connection.setblocking(False)
        if len(self._clients) == MAX_CLIENTS:
            self._make_room()
        if len(self._clients) < MAX_CLIENTS:
            too_long = self._refuse(f"the line is longer than {self._max_line} bytes")
            client = _Client(connection, self._begin(), self._max_line, too_long)
            client.active_s, self._clients[connection] = self._clock(), client
            return
        _dismiss(connection, self._refuse(f"there are {MAX_CLIENTS} clients already"))

    def _make_room(self) -> None:
        """Close the connection of the client that is idle longest, if it was idle long enough."""
        client = min(self._clients.values(), key=lambda client: client.active_s)
        if self._clock() - client.active_s >= IDLE_S:
            del self._clients[client.connection]
            why = f"silent for {IDLE_S:g} s, and {MAX_CLIENTS} clients are the most"
            _dismiss(client.connection, b"" if client.has_unsent else self._refuse(why))

    def _answer(self) -> None:
        for client in list(self._clients.values()):
            if client.has_line:
                client.answer()
            if client.gone:
                client.connection.close()
                del self._clients[client.connection]


def _dismiss(connection: socket.socket, reason: bytes) -> None:
    with connection, contextlib.suppress(OSError):
        connection.send(reason)


class _Client:
    """One connection, its unfinished line, its unsent answers, and the time of its last action."""

    def __init__(
        self, connection: socket.socket, answer: Answer, max_line: int, too_long: bytes
    ) -> None:
        self.connection, self.active_s = connection, 0.0
        self._answer, self._max_line, self._too_long = answer, max_line, too_long
        self._received, self._unsent = bytearray(), bytearray()
        self._end = -1  # where the first line in it ends; found once, whatever its length
        self._closing = self._broken = self._skipping = False

    @property
    def has_unsent(self) -> bool:
        return bool(self._unsent)

    @property
    def has_line(self) -> bool:
        return self._end >= 0 and len(self._unsent) < MAX_UNSENT

    @property
    def wants_more(self) -> bool:
        return not self._closing and self._end < 0

    @property
    def gone(self) -> bool:
        return self._broken or (self._closing and not self._unsent and not self.has_line)

    def read(self) -> None:
        """Read received data."""
        try:
            data = self.connection.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            self._broken = True
            return
        self._closing = not data
        self._receive(data)

    def answer(self) -> None:
        """Answer the next complete line."""
        line = bytes(self._received[: self._end])
        del self._received[: self._end + 1]
        self._end = self._received.find(b"\n")
        self.send(self._too_long if len(line) > self._max_line else self._answer(line))

    def send(self, data: bytes) -> None:
        """Queue an answer, and send as much as possible at once."""
        self._unsent += data
        self.flush()

    def flush(self) -> None:
        """Send as much as possible at once."""
        try:
            del self._unsent[: self.connection.send(self._unsent)]
        except BlockingIOError:
            return
        except OSError:
            self._broken = True

    def _receive(self, data: bytes) -> None:
        if self._skipping:
            _, end, data = data.partition(b"\n")
            self._skipping = not end
        begin = len(self._received)
        self._received += data
        if self._end < 0:
            self._end = self._received.find(b"\n", begin)
        if self._end < 0 and len(self._received) > self._max_line:
            self._received.clear()
            self._skipping = True
            self.send(self._too_long)


class ControlServer(LineServer):
    """Server for a control socket, over which clients control a run.

    The server works only during calls of `serve`.

    Args:
        path: path at which the socket is created. A socket left by a killed process is replaced.
        control: dispatcher that executes and answers the requests.
        clock: function that returns a monotonic time in seconds.

    Raises:
        FileExistsError: another process listens at the path, or a file of another type is there.
        OSError: the socket cannot be created.
    """

    def __init__(
        self, path: Path, control: RequestDispatcher, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(listen_at(path), lambda: control.answer_line, refusal_line, clock=clock)
        self._path, self._inode = path, path.stat().st_ino

    def close(self) -> None:
        """Send pending data, close the connections, and remove the socket."""
        super().close()
        with contextlib.suppress(FileNotFoundError):
            if self._path.stat().st_ino == self._inode:
                self._path.unlink()
