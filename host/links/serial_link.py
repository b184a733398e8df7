"""A byte link to a serial port, which is real, pseudo or remote, by any pyserial URL."""

from __future__ import annotations

import errno
import os
import socket
import stat
import sys
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty, Queue
from typing import Final

import serial
from serial import PortNotOpenError, SerialException, rfc2217
from serial.serialutil import Timeout

from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import let_wait

# TCP settings of both ends of a serial line over TCP.

_KEEP_ALIVE: Final = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}
_UNANSWERED_MS: Final = 25_000


def tune(connection: socket.socket) -> None:
    """Set up a TCP connection to send data at once, and to detect after 25 s that its peer is gone.

    Args:
        connection: TCP connection to tune.

    Raises:
        OSError: the connection is closed, or is not a TCP connection.
    """
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if sys.platform == "linux":
        for name, value in _KEEP_ALIVE.items():
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def _give_up_unanswered(connection: socket.socket) -> None:
    """End a connection if the other machine has not acknowledged sent data for 25 s.

    Args:
        connection: TCP connection to check.

    Raises:
        OSError: the connection is closed, or is not a TCP connection.
    """
    if sys.platform == "linux":
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _UNANSWERED_MS)


# pyserial's `rfc2217://` port, with cheap time-outs and better error messages.

_SAID_SHOWN: Final = 200

_WRITE_S: Final = 1.0
"""Longest time that a write waits for room (5 s in pyserial)."""


class _Rfc2217Serial(rfc2217.Serial):
    """A serial port of another machine (RFC 2217).

    This class avoids three problems of pyserial:

    - When one setting is changed, pyserial negotiates all settings, which takes at least 50 ms. It
      does so even for a time-out, which does not concern the other end.
    - If the other end refuses with a line of text, as ser2net and tickrig do, pyserial ignores the
      line.
    - When a connection ends, pyserial discards data received before.

    Args and attributes are those of `serial.Serial`, except that `write_timeout` cannot be set.
    """

    _agreed: object = None

    def open(self) -> None:
        """Open the remote serial port with RFC 2217.

        Raises:
            SerialException: no server answers, or the server does not support RFC 2217. The message
                contains the answer of the server.
        """
        self._agreed = None
        try:
            super().open()
        except OSError as error:
            if (queue := self._queue) is None:  # there was no connection
                raise
            received = b"".join(queue.get() or b"" for _ in range(queue.qsize()))
            said = received.decode("ascii", "replace").strip()
            instead = f"it said {said[:_SAID_SHOWN]!r}" if said else "it said nothing"
            raise SerialException(f"no serial server answers there: {instead}") from error
        self._socket.settimeout(_WRITE_S)  # type: ignore[attr-defined] # not in typeshed

    def close(self) -> None:
        """Close the port, and its connection even if the other end has reset it."""
        connection = self._socket  # type: ignore[attr-defined] # not in typeshed
        super().close()
        if connection is not None:
            connection.close()

    def read(self, size: int = 1) -> bytes:
        """Read up to `size` bytes, or fewer after the time-out or at the end of the connection.

        Raises:
            SerialException: the connection has ended, and all received data have been read.
        """
        if not self.is_open or (queue := self._queue) is None:
            raise PortNotOpenError
        received = bytearray()
        timeout = Timeout(self.timeout)  # type: ignore[arg-type] # None is for ever
        with suppress(Empty):
            while len(received) < size:
                if (piece := queue.get(timeout=timeout.time_left())) is None:
                    queue.put(None)  # the next look finds the end too
                    if received:
                        break
                    raise SerialException("the connection has ended")
                received += piece
        return bytes(received)

    def _telnet_read_loop(self) -> None:
        """Receive data in a thread. End at invalid telnet data as at a closed connection."""
        try:
            with suppress(TypeError, OSError):
                super()._telnet_read_loop()  # type: ignore[misc] # not in typeshed
        finally:
            if (queue := self._queue) is not None:
                queue.put(None)

    @property
    def _queue(self) -> Queue[bytes | None] | None:
        """Queue of the reading thread, or None if there was no connection yet."""
        queue: Queue[bytes | None] | None = self._read_buffer  # type: ignore[attr-defined]
        return queue

    def _reconfigure_port(self) -> None:
        framing = (self.baudrate, self.bytesize, self.parity, self.stopbits)
        settings = (*framing, self.xonxoff, self.rtscts, self.dsrdtr, self.write_timeout)
        if settings != self._agreed:
            super()._reconfigure_port()  # type: ignore[misc] # not in typeshed
            self._agreed = settings


_UNCOUNTED: Final = ("socket:",)
"""URL schemes for which pyserial reports only whether bytes are waiting, not how many."""

_READ_BYTES: Final = 4_096


class SerialLink:
    """Link that carries bytes over a serial port, opened with pyserial.

    Args:
        url: device path or pyserial URL, such as `/dev/ttyACM0`, `COM3`, `socket://host:port`,
            `rfc2217://host:port` or `loop://`.
        baud: bit rate in bit/s, with 8N1.
        exclusive: whether to lock the port by flock, as pyserial's own tools do. Without the lock,
            two programs could read the port, and each would get a part of the data.

    Raises:
        LinkClosed: the port cannot be opened, or another program uses it.
    """

    def __init__(self, url: str, baud: int = 115_200, *, exclusive: bool = True) -> None:
        self._url, self._uncounted = url, url.startswith(_UNCOUNTED)
        try:
            self._port = _open_port(url, baud, exclusive=exclusive)
        except (serial.SerialException, ValueError, OSError) as error:
            raise LinkClosed(f"cannot open {url!r}: {explain_open_error(url, error)}") from error
        let_wait(self._port)
        found = getattr(self._port, "_socket", None)
        self._connection = found if isinstance(found, socket.socket) else None
        if self._connection is not None:
            with suppress(OSError):  # gone already, as the first look will tell
                tune(self._connection)
                _give_up_unanswered(self._connection)

    @property
    def now_us(self) -> int:
        """Time of the machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def send(self, traffic: bytes, /) -> None:
        """Write bytes to the serial port.

        Args:
            traffic: bytes to send.

        Raises:
            LinkClosed: the port is gone, or accepts no data for 1 s.
        """
        try:
            self._port.write(traffic)
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkClosed(f"cannot write to {self._url!r}: {error}") from error

    def receive(self, timeout_us: int, /) -> bytes:
        """Wait for the next byte, then return all bytes that have been received.

        Args:
            timeout_us: longest wait in microseconds. 0 does not wait.

        Returns:
            The bytes, empty after the timeout.

        Raises:
            LinkClosed: the port is gone.
        """
        try:
            self._port.timeout = timeout_us / 1e6
            first = self._port.read(1)
            return first + self._take_rest() if first else b""
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkClosed(f"cannot read from {self._url!r}: {error}") from error

    def close(self) -> None:
        """Close the port."""
        self._port.close()
        if self._connection is not None:
            self._connection.close()  # pyserial forgets one that the other end has reset

    def _take_rest(self) -> bytes:
        if not self._uncounted:
            return self._port.read(self._port.in_waiting)
        self._port.timeout = 0
        with suppress(serial.SerialException):  # the end of it, which the next look finds too
            return self._port.read(_READ_BYTES)
        return b""


def _open_port(url: str, baud: int, *, exclusive: bool) -> serial.Serial | _Rfc2217Serial:
    """Open a pyserial URL. Use `_Rfc2217Serial` for RFC 2217."""
    if not url.startswith("rfc2217:"):
        return serial.serial_for_url(
            url, baudrate=baud, timeout=0, write_timeout=1, exclusive=exclusive or None
        )

    return _Rfc2217Serial(url, baudrate=baud, timeout=0)


_LOCKS: Final = Path("/proc/locks")
_COMMAND_SHOWN: Final = 100


def explain_open_error(url: str, error: Exception) -> str:
    """Return a text that explains why a serial port cannot be opened.

    Args:
        url: device path or pyserial URL of the port.
        error: exception that was raised when the port was opened.
    """
    around = error.__context__ if error.__cause__ is None else None
    if isinstance(around, OSError) and around.strerror:
        error = around  # pyserial names the port again, around it
    number = error.errno if isinstance(error, OSError) else None
    if sys.platform != "win32":
        if around is not None and around.args[:1] == (errno.ENOTTY,):
            return "it is no serial port"
        if number in (errno.EAGAIN, errno.EBUSY):
            return f"another program uses it{_holder(url)}"
        if number == errno.EACCES:
            return f"permission denied{_remedy(url)}"
    if number is None or number < 0:  # of getaddrinfo
        return getattr(error, "strerror", None) or str(error)
    return os.strerror(number)


if sys.platform != "win32":

    def _holder(path: str) -> str:
        """Return `: COMMAND (process NUMBER)` of the owner of a file lock, empty if unknown."""
        try:
            found = os.stat(path)
            locks = _LOCKS.read_text("ascii").splitlines()
        except OSError:
            return ""
        device = f"{os.major(found.st_dev):02x}:{os.minor(found.st_dev):02x}:{found.st_ino}"
        for lock in locks:
            _, kind, _, _, process, file, *_ = lock.split()
            if kind == "FLOCK" and file == device:
                return f": {_command(process)} (process {process})"
        return ""

    def _command(process: str) -> str:
        try:
            words = Path(f"/proc/{process}/cmdline").read_bytes().rstrip(b"\0")
        except OSError:
            return "?"
        command = " ".join(words.replace(b"\0", b" ").decode("utf-8", "replace").split())
        return command if len(command) <= _COMMAND_SHOWN else f"{command[:_COMMAND_SHOWN]}..."

    def _remedy(path: str) -> str:
        """Return how to get access to the port.

        The advice is to join the group of the file, if this group may read and write the file.
        """
        import grp  # noqa: PLC0415 - not on Windows, which has no such files either

        try:
            found = os.stat(path)
            group = grp.getgrgid(found.st_gid).gr_name
        except (OSError, KeyError):
            return ""
        if found.st_mode & stat.S_IRWXG < stat.S_IRGRP | stat.S_IWGRP:
            return "; its owner alone may use it"
        return f"; join its group: sudo usermod -aG {group} $USER, then log in again"
