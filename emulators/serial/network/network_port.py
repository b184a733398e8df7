"""The host's end of a serial line, served over TCP."""

from __future__ import annotations

import errno
import ipaddress
import logging
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

from tickrig.device.twin import NonCopyable
from tickrig.emulators.serial.host_setting import HostSetting
from tickrig.emulators.serial.network.dismissed_host import DismissedHost
from tickrig.emulators.serial.network.host_connection import HostConnection
from tickrig.emulators.serial.network.serve_url import LOOPBACK, ServeUrl
from tickrig.wire.instant import NEVER

RECEIVE_BUFFER_BYTES: Final = 4_096
"""Of the kernel: a host that writes faster than the line is held up soon, as at a real port."""

MAX_BAUD: Final = 4_000_000
"""Above it no adapter goes: the device is on USB, and its host may set what it likes."""

MAX_DISMISSED: Final = 8

QUIET_US: Final = 10_000_000
"""After a warning there is none for so long."""

OPEN_TO_OTHERS: Final = (
    "Whoever reaches port %s of %s can drive this device: there is no password."
    " Leave out the host to serve this machine alone."
)

_log = logging.getLogger(__name__)


class NetworkPort(NonCopyable):
    """A `Port[bytes]` that a host reaches over TCP; hosts may come and go, one at a time.

    A second host is told so in a line of text and is left, unless the present one sends no
    more, or has not read for 30 s. Whether it does is known only behind all that it sent: until
    that is on the line one more host is listened to, and a little of what it sends is kept.
    While there is no host, what the device sends is gone, as
    on a line without one. Nothing here ever waits, and what is kept for a host is bounded. There
    is no password: a port that other machines can reach is warned of.

    Args:
        url: where to listen.
        buffer_bytes: bytes kept for a host that does not read.

    Attributes:
        url: where hosts of this machine connect, as pyserial opens it, with its port.
        address: the address that it listens at.
        port: its TCP port.
        spoken: whether a host ever sent something.

    Raises:
        OSError: the port is taken, or the host is no address of this machine; the URL is its
            `filename`.
    """

    why_not_copied = "it is a TCP port of this machine"

    def __init__(self, url: ServeUrl, buffer_bytes: int = 4_096) -> None:
        self._listener = _listen(url)
        self._buffer_bytes, self._baud = buffer_bytes, 115_200
        self._host: HostConnection | None = None
        self._next: tuple[HostConnection, str] | None = None
        self._dismissed: list[DismissedHost] = []
        self._lost, self._peer, self._quiet_until_us = 0, "", 0
        self._setting: HostSetting | None = None
        self.spoken = False
        self.address, self.port = self._listener.getsockname()[:2]
        self.url = str(replace(url, host=_reachable(self.address), port=self.port))
        if not ipaddress.ip_address(self.address.partition("%")[0]).is_loopback:
            _log.warning(OPEN_TO_OTHERS, self.port, self.address)

    @property
    def due_us(self) -> int:
        """Unknown to anybody but the host."""
        return NEVER

    @property
    def lost(self) -> int:
        """Bytes dropped because a host did not read."""
        return self._lost + (self._host.lost if self._host else 0)

    @property
    def host_setting(self) -> str:
        """What the host has set it to, as `9600 8N1`; empty if that is the device's, or unknown."""
        return self._setting.differing if self._setting else ""

    def watch_setting(self, baud: int, notify: Callable[[str], None]) -> None:
        """Set it as the device is, and tell when a host sets it otherwise; see `HostSetting`.

        Args:
            baud: the device's rate in bit/s, with 8N1; above 4 Mbit/s it is not watched.
            notify: called with a setting as `9600 8N1` that is not the device's.
        """
        self._baud = baud
        if baud <= MAX_BAUD:
            own = f"{baud} 8N1"
            self._setting = HostSetting(lambda: self._present_setting or own, own, notify)

    def poll(self, now_us: int, /) -> bytes:
        """Take some of what the host sent; let hosts come and go."""
        data = self._host.poll(now_us) if self._host else b""
        self.spoken |= bool(data)
        if self._host and self._host.mistake:
            self._leave(self._host, self._peer, now_us)
            self._forget(self._host)
        elif self._host and self._host.over:
            self._hang_up()
        self.attend(now_us)
        self._let_in(now_us)
        return data

    def attend(self, now_us: int, /) -> None:
        """Let hosts come and go, and give them what is kept for them, but take nothing.

        It is called between polls as long as the line has no room for what was taken before.
        """
        if self._host is not None:
            self._host.flush(now_us)
        self._dismissed = [host for host in self._dismissed if not host.is_gone(now_us)]
        self._attend_next(now_us)
        if self._setting is not None:
            self._setting.look(now_us)

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Send to the host, if there is one, as much as fits; keep the rest for later."""
        if self._host is not None:
            self._host.send(now_us, traffic)

    def close(self) -> None:
        """Hang up, and listen no more."""
        self._hang_up()
        for host in self._dismissed:
            host.close()
        if self._next is not None:
            self._next[0].close()
        self._listener.close()
        self._setting = None

    @property
    def _present_setting(self) -> str:
        return self._host.setting if self._host else ""

    def _attend_next(self, now_us: int) -> None:
        """Accept the next host, and listen to it until the line is its own."""
        if self._next is None:
            with suppress(OSError):  # nobody, or gone again, or no descriptor is left
                connection, address = self._listener.accept()
                self._next = self._connected(connection), "{}:{}".format(*address[:2])
            return
        host, peer = self._next
        host.hold(now_us)
        if host.mistake:
            self._leave(host, peer, now_us)
        elif host.over:
            host.close()
        else:
            return
        self._next = None

    def _let_in(self, now_us: int) -> None:
        """Give the line to the next host, or refuse it, as soon as it is known which."""
        if self._next is None:
            return
        host, peer = self._next
        if self._host is None or self._host.has_ended(now_us):
            self._hang_up()
            self._host, self._peer = host, peer
            _log.info("%s: host %s", self.url, peer)
        elif self._host.is_idle:
            self._refuse(host.connection, peer, now_us)
        else:
            return
        self._next = None

    def _connected(self, connection: socket.socket) -> HostConnection:
        if self.url.startswith("socket:"):
            return HostConnection(connection, self._buffer_bytes)
        # slow to load, and only wanted here
        from tickrig.emulators.serial.network.rfc2217_connection import (  # noqa: PLC0415
            Rfc2217Connection,
        )

        return Rfc2217Connection(connection, self._buffer_bytes, self._baud)

    def _refuse(self, connection: socket.socket, peer: str, now_us: int) -> None:
        """Send a second host away."""
        reason = f"{self.url} has a host already: {self._peer}"
        self._warn(now_us, f"{reason}; {peer} was refused")
        self._dismiss(connection, now_us, reason)

    def _leave(self, host: HostConnection, peer: str, now_us: int) -> None:
        """Send a host away that cannot be understood."""
        self._warn(now_us, f"{self.url}: host {peer} was left: {host.mistake}")
        self._dismiss(host.connection, now_us, host.mistake)

    def _dismiss(self, connection: socket.socket, now_us: int, reason: str) -> None:
        self._dismissed.append(DismissedHost(connection, now_us, reason))
        if len(self._dismissed) > MAX_DISMISSED:
            self._dismissed.pop(0).close()

    def _hang_up(self) -> None:
        if self._host is not None:
            self._host.close()
            self._forget(self._host)

    def _forget(self, host: HostConnection) -> None:
        self._lost += host.lost
        self._host = None

    def _warn(self, now_us: int, text: str) -> None:
        """Tell people, but not all that a host does over and over."""
        if now_us >= self._quiet_until_us:
            self._quiet_until_us = now_us + QUIET_US
            _log.warning("%s", text)


def _listen(url: ServeUrl) -> socket.socket:
    """Return a listening socket, non-blocking; OSError names the URL."""
    try:
        family, kind, protocol, address = _resolve(url)
        listener = socket.socket(family, kind, protocol)
        try:
            if os.name == "posix":  # else somebody could take the same port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with suppress(OSError):
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
            listener.bind(address)
            listener.listen()
        except OSError:
            listener.close()
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(url)) from error
    listener.setblocking(False)
    return listener


def _resolve(url: ServeUrl) -> tuple[int, int, int, Any]:
    """Return family, kind, protocol and address of where to listen."""
    try:
        found = socket.getaddrinfo(url.host, url.port, type=socket.SOCK_STREAM)
    except ValueError as error:  # what IDNA cannot take, as a..b
        raise OSError(errno.EINVAL, f"{url.host!r} is no name of a host") from error
    family, kind, protocol, _, address = found[0]
    return family, kind, protocol, address


def _reachable(address: str) -> str:
    """Return the address at which this machine reaches itself."""
    every = {"0.0.0.0": LOOPBACK, "::": "::1"}
    return every.get(address, address)
