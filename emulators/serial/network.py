"""A serial line served over TCP, plain or by RFC 2217, to hosts that cannot open a pty."""

from __future__ import annotations

import errno
import ipaddress
import logging
import os
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final, cast

from serial import SerialBase, rfc2217
from serial.rfc2217 import COM_PORT_OPTION, IAC, IAC_DOUBLED, PortManager

from tickrig.device.twin import NonCopyable
from tickrig.emulators.serial.bridge import HostSetting
from tickrig.host.links.serial_link import tune
from tickrig.host.text.values import MOST_PORT, parse_port
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import Parity, UartSetting, sample

# Where a serial line is served: `rfc2217://[HOST:]PORT` or `socket://[HOST:]PORT`.

# Theory of operation
# ===================
#
# A port has at most one host (`_host`), one host that waits (`_next`), and a few refused hosts
# whose connections are being closed (`_dismissed`). All sockets are non-blocking. They are
# processed in `poll`, once a tick, or in `attend` while the line has no room. So no host can block
# the rig.
#
# The second host. The end of a connection comes after its data. So the port knows whether the
# first host is still connected only after it has read all data of that host. Until then it accepts
# the second host and reads from it, because a host of RFC 2217 gives up without negotiation. It
# holds a little of the second host's data. Then `_let_in` decides, in a later tick if necessary:
#
# - If the first host has ended or is stuck, the second host gets the line, with its held data
#   first.
# - If no data of the first host were waiting at the latest poll, the first host is active, and the
#   second host is refused.
#
# Ends. A host that has closed its sending side, such as `nc` at the end of its input, still
# receives data for one second. A refused host receives a line with the reason. Its connection is
# closed for sending and read until it is empty: closing a connection with unread data resets it,
# and the line may then be lost (`DismissedHost`).
#
# Bounds. No host can make this process grow:
#
# - Whole sends beyond `buffer_bytes` are dropped and counted in `lost`, as on a pty.
# - About two reads of a waiting host are held.
# - A suboption has at most 256 bytes.
# - If a host negotiates without reading the answers, the port stops reading from it at 8 KiB of
#   answers, because each read may produce more (`_may_read`).
#
# The buffers of the kernel are small for the same reason: their data are outside the time of the
# rig.
#
# The settings of RFC 2217 are answered and stored. The line keeps the rate of the device, which
# the device may change (`device_uses`). If the host has another setting, the data in both
# directions are sampled, as at a real port, separately for each tick. The user gets a warning
# (`HostSetting`).

_SCHEMES: Final = ("rfc2217", "socket")
_LOOPBACK: Final = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class ServeUrl:
    """Network address at which an emulated serial line is served to hosts, with the protocol.

    Attributes:
        scheme: protocol: `rfc2217`, or `socket` for plain bytes of the line.
        host: name or address of this machine. An IPv6 address has no brackets.
        port: TCP port, or 0 to let the system select a port.
    """

    scheme: str
    host: str = _LOOPBACK
    port: int = 0

    def __str__(self) -> str:
        """Return the URL as pyserial opens it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


def parse_serve_url(text: str) -> ServeUrl:
    """Parse the address at which a serial line is to be served.

    Args:
        text: address as `SCHEME://[HOST:]PORT`. Without a host only this machine can connect.

    Raises:
        ValueError: the URL is invalid. The message has the URL and the allowed form.

    >>> str(parse_serve_url("rfc2217://7000")), str(parse_serve_url("socket://[::1]:0"))
    ('rfc2217://127.0.0.1:7000', 'socket://[::1]:0')
    """
    scheme, found, place = text.partition("://")
    if not found or scheme not in _SCHEMES:
        allowed = " or ".join(f"{name}://[HOST:]PORT" for name in _SCHEMES)
        raise ValueError(f"{text!r} is not {allowed}")
    host, colon, port = place.rpartition(":")
    bare = host[1:-1] if host[:1] + host[-1:] == "[]" else host
    if colon and not bare:
        raise ValueError(f"{text!r}: no host before the colon; 0.0.0.0 is every address")
    number = parse_port(port)
    if number is None:
        raise ValueError(f"{text!r}: port {port!r} is not in 0..{MOST_PORT}")
    if ":" in bare and bare == host:
        raise ValueError(f"{text!r}: an IPv6 address stands in brackets, as [::1]")
    return ServeUrl(scheme, bare or _LOOPBACK, number)


# A host that was refused.

LEAVING_US: Final = 1_000_000
_DISCARDED_BYTES: Final = 65_536


class DismissedHost:
    """Connection to a refused host, which stays open for a second so that the host can read why.

    If a connection is closed while its host still sends, the connection is reset. Some systems then
    discard data that the host has not read yet, such as the reason. To avoid a reset, this object
    reads the data of the refused host and discards the data.

    Args:
        connection: connection to the host.
        now_us: present time in microseconds.
        reason: reason for the refusal, as a line of text.
    """

    def __init__(self, connection: socket.socket, now_us: int, reason: str) -> None:
        self._connection, self._until_us = connection, now_us + LEAVING_US
        connection.setblocking(False)
        with suppress(OSError):  # gone already
            connection.send(f"{reason}\r\n".encode())
            # The end of the reason is seen at once; the connection stays until the host has
            # read it.
            connection.shutdown(socket.SHUT_WR)

    def is_gone(self, now_us: int) -> bool:
        """Close the connection after the host or the time-out; return whether it is closed."""
        try:
            gone = not self._connection.recv(_DISCARDED_BYTES)
        except BlockingIOError:
            gone = False
        except OSError:
            gone = True
        if gone or now_us >= self._until_us:
            self.close()
            return True
        return False

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


# A host on a TCP connection with the plain bytes of the line.

READ_BYTES: Final = 1_024
_SEND_BUFFER_BYTES: Final = 16_384
"""Size of the kernel's buffer. Data in the buffer reach a slow host late."""

LAST_WORDS_US: Final = 1_000_000
STUCK_US: Final = 30_000_000


class HostConnection:
    """A host on a plain connection; nothing here blocks.

    Data that the host has not read are kept, up to `buffer_bytes`. Beyond that, whole sends are
    dropped and counted, as on a pty. A host that has stopped sending but may still read, such as
    `nc` at the end of its input, gets the data of one more second.

    Args:
        connection: connection to the host.
        buffer_bytes: largest number of bytes kept for a host that does not read.

    Attributes:
        connection: connection to the host.
        over: whether the connection is closed.
        mistake: reason to drop the host, or empty unless the host sent invalid data.
        is_idle: whether no data of the host were waiting at the latest poll.
        lost: number of bytes dropped because the host did not read.
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
    def setting(self) -> UartSetting | None:
        """The port setting that this host has requested, or None if it cannot set the port."""
        return None

    def has_ended(self, now_us: int) -> bool:
        """Return whether the line is free for another host.

        The line is free if this host has stopped sending, or has not read its data for a long time.
        """
        stuck = self._stuck_us is not None and now_us - self._stuck_us >= STUCK_US
        return self.over or stuck or self._last_words_us is not None

    def poll(self, now_us: int) -> bytes:
        """Return part of the data of the host; held data come first."""
        if not self._held:
            return self._look(now_us)
        data, self._held, self.is_idle = self._held, b"", False
        if self._last_words_us is not None:  # it is answered from now on
            self._last_words_us = now_us + LAST_WORDS_US
        return data

    def hold(self, now_us: int) -> None:
        """Keep data of a host that waits because another host uses the line.

        A host of RFC 2217 starts with a negotiation, and gives up if it gets no answers. Therefore
        this method answers the negotiation of a waiting host.

        Only the first part of the waiting host's data is read and kept.
        """
        if len(self._held) < READ_BYTES and not self.has_ended(now_us):
            self._held += self._look(now_us)
        self.over |= self.has_ended(now_us) and not self._held  # it has not waited

    def send(self, now_us: int, traffic: bytes) -> None:
        """Send as much data as fits, and buffer the rest."""
        if len(self._unsent) + len(traffic) > self._buffer_bytes:
            self.lost += len(traffic)
        else:
            self._unsent += self._give_out(traffic)
        self.flush(now_us)

    def flush(self, now_us: int) -> None:
        """Send as much of the buffered data as fits."""
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
        """Close the connection."""
        self.over = True
        self.connection.close()

    @property
    def _may_read(self) -> bool:
        """Whether there is room for the answers that reading may cause."""
        return True

    def _take_in(self, data: bytes) -> bytes:
        """Return the part for the device."""
        return data

    def _give_out(self, traffic: bytes) -> bytes:
        """Return the bytes encoded for the host."""
        return traffic

    def _look(self, now_us: int) -> bytes:
        """Read part of the received data."""
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
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
    tune(connection)


# A host on a connection that speaks telnet with the serial options of RFC 2217.

_SIGNATURE: Final = b"tickrig"
MAX_UNSENT_BYTES: Final = 8_192
MAX_SUBOPTION_BYTES: Final = 256

_VALUE_BYTES: Final = {
    **dict.fromkeys(
        [
            rfc2217.SET_DATASIZE,
            rfc2217.SET_PARITY,
            rfc2217.SET_STOPSIZE,
            rfc2217.SET_CONTROL,
            rfc2217.SET_LINESTATE_MASK,
            rfc2217.SET_MODEMSTATE_MASK,
            rfc2217.PURGE_DATA,
        ],
        1,
    ),
    rfc2217.SET_BAUDRATE: 4,
}
"""Minimum length of the value of a command."""

_KNOWN_VALUES: Final[Mapping[bytes, Mapping[int, object]]] = {
    rfc2217.SET_PARITY: rfc2217.RFC2217_REVERSE_PARITY_MAP,
    rfc2217.SET_STOPSIZE: rfc2217.RFC2217_REVERSE_STOPBIT_MAP,
}
_NO_FLOW_CONTROL_IN: Final = 14
_NO_FLOW_CONTROL: Final = 1


class _QuietAdapter(SerialBase):
    """The settings of a serial adapter with nothing on its modem lines: all of them are off."""

    cts = dsr = ri = cd = False

    def reset_input_buffer(self) -> None:
        """Do nothing: a host that requests a purge drops the received data on its own side."""

    def reset_output_buffer(self) -> None:
        """Do nothing: earlier data are already on the line."""


class _SafePortManager(PortManager):
    """pyserial's manager, completed: it gives all answers of RFC 2217 and accepts any value."""

    def _telnet_process_subnegotiation(self, suboption: bytes) -> None:
        option, command, value = suboption[:1], suboption[1:2], suboption[2:]
        if option != COM_PORT_OPTION or len(value) < _VALUE_BYTES.get(command, 0):
            return
        if command in _KNOWN_VALUES and value[0] not in _KNOWN_VALUES[command]:
            suboption = option + command + b"\0"  # it gets the settings
        # IAC SB 2C 00 IAC SE asks for the signature; 64h is the answer's command (RFC 2217:
        # server + 100).
        if command == b"\0":
            self.rfc2217_send_subnegotiation(b"\x64", _SIGNATURE)
        elif command == rfc2217.SET_CONTROL and (state := self._control_state(value[0])):
            self.rfc2217_send_subnegotiation(rfc2217.SERVER_SET_CONTROL, bytes([state]))
        else:
            super()._telnet_process_subnegotiation(suboption)  # type: ignore[misc] # no stub
            if command in (rfc2217.SET_LINESTATE_MASK, rfc2217.SET_MODEMSTATE_MASK):
                self.rfc2217_send_subnegotiation(rfc2217.RFC2217_ANSWER_MAP[command], value[:1])

    def _control_state(self, request: int) -> int:
        """Return the answer to SET-CONTROL if pyserial has none, else 0."""
        port = self.serial
        # SET-CONTROL: 4, 7, 10 ask for break, DTR, RTS; the next number says on, the one
        # after it off.
        for query, is_on in ((4, port.break_condition), (7, port.dtr), (10, port.rts)):
            if request == query:
                return query + 1 if is_on else query + 2
        if request in range(13, 17):
            return _NO_FLOW_CONTROL_IN
        return _NO_FLOW_CONTROL if request in range(17, 20) else 0


class Rfc2217Connection(HostConnection):
    """Connection to a host that may set the serial port by RFC 2217.

    For example, pyserial is such a host if it opens a URL `rfc2217://`. Settings that the host
    requests are acknowledged and stored, but the device keeps its own setting. DTR, RTS and break
    of the host have no effect. CTS, DSR, CD and RI are off. A host that sends invalid telnet data
    is disconnected.

    Two requests of RFC 2217 are not emulated: FLOWCONTROL-SUSPEND, and the purging of data that are
    already on the line.

    Args:
        connection: connection to the host.
        buffer_bytes: largest number of bytes kept for a host that does not read.
        setting: port setting until the host changes it.
    """

    def __init__(self, connection: socket.socket, buffer_bytes: int, setting: UartSetting) -> None:
        super().__init__(connection, buffer_bytes)
        self._adapter = _QuietAdapter(  # type: ignore[abstract] # it carries no bytes
            baudrate=setting.baud,
            bytesize=setting.data_bits,
            parity=setting.parity,
            stopbits=setting.stop_bits,
        )
        # typeshed wants two pyserial ports; any port and a writer will do (pyserial docs)
        self._manager = _SafePortManager(self._adapter, self)  # type: ignore[arg-type]

    @property
    def setting(self) -> UartSetting | None:
        """The port setting of the host."""
        port = self._adapter
        parity = cast(Parity, port.parity)  # pyserial has checked it
        return UartSetting(max(1, port.baudrate), port.bytesize, parity, port.stopbits)

    def write(self, data: bytes) -> None:
        """Answer a negotiation; pyserial's manager calls this."""
        self._unsent += data

    @property
    def _may_read(self) -> bool:
        return len(self._unsent) < MAX_UNSENT_BYTES

    def _take_in(self, data: bytes) -> bytes:
        try:
            taken = b"".join(self._manager.filter(data))
        except TypeError:  # how pyserial's manager fails at it
            self.mistake = "IAC SE without IAC SB"
            return b""
        if len(self._manager.suboption or b"") > MAX_SUBOPTION_BYTES:
            self.mistake = f"IAC SB without IAC SE in {MAX_SUBOPTION_BYTES} bytes"
        return taken

    def _give_out(self, traffic: bytes) -> bytes:
        return traffic.replace(IAC, IAC_DOUBLED)


# The host's end of a serial line, served over TCP.

_RECEIVE_BUFFER_BYTES: Final = 4_096
"""Size of the kernel's buffer. A host that writes faster than the line soon blocks, as at a real
port."""

_MAX_BAUD: Final = 4_000_000
"""Highest rate of adapters. Above it the device is on USB, and its host may use any setting."""

MAX_DISMISSED: Final = 8

QUIET_US: Final = 10_000_000
"""Shortest time between two warnings."""

_OPEN_TO_OTHERS: Final = (
    "Anyone who reaches port %s of %s can drive this device: there is no password."
    " Leave out the host to serve this machine alone."
)

_log = logging.getLogger(__name__)


class NetworkPort(NonCopyable):
    """A `Port[bytes]` for hosts over TCP, which may connect and leave, one at a time.

    A second host is refused with a line of text, unless the present host has stopped sending, or
    has not read for 30 s. The port can decide this only after all data of the present host are on
    the line. Until then the port accepts one more host and holds a little of the new host's data.

    Without a host, data of the device are lost, as on an open line. No call blocks, and all buffers
    are bounded. There is no password: the port logs a warning if other machines can reach it.

    Args:
        url: address to listen at.
        buffer_bytes: largest number of bytes kept for a host that does not read.

    Attributes:
        url: URL that pyserial opens on this machine, with the port number.
        address: address at which the port listens.
        port: number of the TCP port.
        spoken: whether a host ever sent data.

    Raises:
        OSError: the port is in use, or the host is not an address of this machine. The `filename`
            of the exception is the URL.
    """

    why_not_copied = "it is a TCP port of this machine"
    due_us: Final = NEVER  # only the host knows when data arrive

    def __init__(self, url: ServeUrl, buffer_bytes: int = 4_096) -> None:
        self._listener = _listen(url)
        self._buffer_bytes, self._uart = buffer_bytes, UartSetting()
        self._samples = False
        self._host: HostConnection | None = None
        self._next: tuple[HostConnection, str] | None = None
        self._dismissed: list[DismissedHost] = []
        self._lost, self._peer, self._quiet_until_us = 0, "", 0
        self._setting: HostSetting | None = None
        self.spoken = False
        self.address, self.port = self._listener.getsockname()[:2]
        self.url = str(replace(url, host=_reachable(self.address), port=self.port))
        if not ipaddress.ip_address(self.address.partition("%")[0]).is_loopback:
            _log.warning(_OPEN_TO_OTHERS, self.port, self.address)

    @property
    def lost(self) -> int:
        """Number of bytes dropped because a host did not read."""
        return self._lost + (self._host.lost if self._host else 0)

    @property
    def host_setting(self) -> str:
        """The setting of the host, such as `9600 8N1`, if it differs from the device's.

        The text is empty if both settings are equal, or if the setting of the host is unknown.
        """
        return self._setting.differing if self._setting else ""

    def watch_setting(self, baud: int, notify: Callable[[str], None]) -> None:
        """Set the port to the device's setting, and report each host that requests another setting.

        Args:
            baud: bit rate of the device in bit/s, with 8N1. If the rate is above 4 Mbit/s, no host
                is reported: such a fast device is connected by USB, so a host may request any
                setting.
            notify: function that is called with each setting that differs, such as `9600 8N1`.
        """
        self._uart = UartSetting(baud)
        if baud <= _MAX_BAUD:
            self._setting = HostSetting(self._shown_setting, str(self._uart), notify)

    def device_uses(self, setting: UartSetting) -> None:
        """Note a new setting of the device; a host with another setting now gets garbled data.

        The garbled data are those that a real UART with the host's setting would receive.

        Args:
            setting: new setting of the device. If the rate is above 4 Mbit/s, the device
                understands a host of any setting.
        """
        self._uart, self._samples = setting, setting.baud <= _MAX_BAUD
        if self._setting is not None:
            self._setting.want(str(setting))

    def poll(self, now_us: int, /) -> bytes:
        """Return part of the host's data; accept and close connections."""
        data = self._host.poll(now_us) if self._host else b""
        self.spoken |= bool(data)
        if (setting := self._differing) is not None:
            data = _sampled(data, setting, self._uart)
        if self._host and self._host.mistake:
            self._leave(self._host, self._peer, now_us)
            self._forget(self._host)
        elif self._host and self._host.over:
            self._hang_up()
        self.attend(now_us)
        self._let_in(now_us)
        return data

    def attend(self, now_us: int, /) -> None:
        """Accept and close connections, and send buffered data to hosts, but read nothing.

        The bridge calls this method instead of `poll` while the emulated line is full.
        """
        if self._host is not None:
            self._host.flush(now_us)
        self._dismissed = [host for host in self._dismissed if not host.is_gone(now_us)]
        self._attend_next(now_us)
        if self._setting is not None:
            self._setting.look(now_us)

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Send data to the host, and keep data that the host has not read yet in a buffer.

        Without a host the data are lost.
        """
        if self._host is not None:
            if (setting := self._differing) is not None:
                traffic = _sampled(traffic, self._uart, setting)
            self._host.send(now_us, traffic)

    def close(self) -> None:
        """Close the connections and the listening socket."""
        self._hang_up()
        for host in self._dismissed:
            host.close()
        if self._next is not None:
            self._next[0].close()
        self._listener.close()
        self._setting = None

    def _shown_setting(self) -> str:
        return str((self._host and self._host.setting) or self._uart)

    @property
    def _differing(self) -> UartSetting | None:
        """The setting of the host, if the device does not understand it."""
        setting = self._host.setting if self._host and self._samples else None
        return None if setting == self._uart else setting

    def _attend_next(self, now_us: int) -> None:
        """Accept the next host, and let it negotiate until it gets the line."""
        if self._next is None:
            with suppress(OSError):  # no host, closed again, or no descriptor left
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
        """Pass the line to the next host, or refuse it, as soon as this is decided."""
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
        return Rfc2217Connection(connection, self._buffer_bytes, self._uart)

    def _refuse(self, connection: socket.socket, peer: str, now_us: int) -> None:
        """Refuse a second host."""
        reason = f"{self.url} has a host already: {self._peer}"
        self._warn(now_us, f"{reason}; {peer} was refused")
        self._dismiss(connection, now_us, reason)

    def _leave(self, host: HostConnection, peer: str, now_us: int) -> None:
        """Drop a host that sends invalid data."""
        self._warn(now_us, f"{self.url}: host {peer} was dropped: {host.mistake}")
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
        """Log a warning, but not each repetition."""
        if now_us >= self._quiet_until_us:
            self._quiet_until_us = now_us + QUIET_US
            _log.warning("%s", text)


def _sampled(data: bytes, sender: UartSetting, receiver: UartSetting) -> bytes:
    return bytes(each.value for each in sample(data, sender, receiver))


def _listen(url: ServeUrl) -> socket.socket:
    """Return a listening socket that does not block; an OSError names the URL."""
    try:
        family, kind, protocol, address = _resolve(url)
        listener = socket.socket(family, kind, protocol)
        try:
            if os.name == "posix":  # else another program could take the same port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with suppress(OSError):
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
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
    """Return family, kind, protocol and address for listening."""
    try:
        found = socket.getaddrinfo(url.host, url.port, type=socket.SOCK_STREAM)
    except ValueError as error:  # what IDNA cannot take, as a..b
        raise OSError(errno.EINVAL, f"{url.host!r} is no name of a host") from error
    family, kind, protocol, _, address = found[0]
    return family, kind, protocol, address


def _reachable(address: str) -> str:
    """Return the address at which this machine reaches itself."""
    every = {"0.0.0.0": _LOOPBACK, "::": "::1"}
    return every.get(address, address)
