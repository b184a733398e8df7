"""A byte link to a serial port, real, pseudo or remote, by any pyserial URL."""

from __future__ import annotations

import errno
import os
import socket
import stat
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import serial

from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.ready import let_wait
from tickrig.host.links.tcp import give_up_unanswered, tune

if TYPE_CHECKING:
    from tickrig.host.links.rfc2217_serial import Rfc2217Serial

UNCOUNTED: Final = ("socket:",)
"""URLs under which pyserial only knows whether bytes are waiting, not how many."""

READ_BYTES: Final = 4_096


class SerialLink:
    """A `Link[bytes]` over pyserial.

    Args:
        url: a device path or pyserial URL: `/dev/ttyACM0`, `COM3`,
            `socket://host:port`, `rfc2217://host:port`, `loop://`.
        baud: bit rate in bit/s, 8N1.
        exclusive: whether to keep out other programs that ask in the same way, by flock as
            pyserial's own tools do; of two readers each would get a part.

    Raises:
        LinkClosed: the port cannot be opened, or another program uses it.
    """

    def __init__(self, url: str, baud: int = 115_200, *, exclusive: bool = True) -> None:
        self._url, self._uncounted = url, url.startswith(UNCOUNTED)
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
                give_up_unanswered(self._connection)

    @property
    def now_us(self) -> int:
        """The machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def send(self, traffic: bytes, /) -> None:
        """Write bytes.

        Args:
            traffic: the bytes.

        Raises:
            LinkClosed: the port is gone, or takes none for 1 s.
        """
        try:
            self._port.write(traffic)
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkClosed(f"cannot write to {self._url!r}: {error}") from error

    def receive(self, timeout_us: int, /) -> bytes:
        """Wait for a first byte, then take all that are there.

        Args:
            timeout_us: how long to wait; 0 only looks.

        Returns:
            The bytes, none if none came in time.

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
            return self._port.read(READ_BYTES)
        return b""


def _open_port(url: str, baud: int, *, exclusive: bool) -> serial.Serial | Rfc2217Serial:
    """Open what pyserial knows under a URL; one of RFC 2217 with what pyserial's lacks."""
    if not url.startswith("rfc2217:"):
        return serial.serial_for_url(
            url, baudrate=baud, timeout=0, write_timeout=1, exclusive=exclusive or None
        )
    from tickrig.host.links.rfc2217_serial import Rfc2217Serial  # noqa: PLC0415 - seldom wanted

    return Rfc2217Serial(url, baudrate=baud, timeout=0)


LOCKS: Final = Path("/proc/locks")
COMMAND_SHOWN: Final = 100


def explain_open_error(url: str, error: Exception) -> str:
    """Say what is wrong with a port.

    Args:
        url: the port, as it was asked for.
        error: what opening it raised.
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
        """Return `: COMMAND (process NUMBER)` of who has locked a file, empty if not shown."""
        try:
            found = os.stat(path)
            locks = LOCKS.read_text("ascii").splitlines()
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
        return command if len(command) <= COMMAND_SHOWN else f"{command[:COMMAND_SHOWN]}..."

    def _remedy(path: str) -> str:
        """Say how to be let in: by the group of the file, if that may read and write."""
        import grp  # noqa: PLC0415 - not on Windows, which has no such files either

        try:
            found = os.stat(path)
            group = grp.getgrgid(found.st_gid).gr_name
        except (OSError, KeyError):
            return ""
        if found.st_mode & stat.S_IRWXG < stat.S_IRGRP | stat.S_IWGRP:
            return "; its owner alone may use it"
        return f"; join its group: sudo usermod -aG {group} $USER, then log in again"
