"""Join an emulated serial line with the outside world, or with the caller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Generic

from tickrig.device.core import W
from tickrig.device.twin import Copyable, Listeners, itself
from tickrig.emulators.rig.port import ByteEnd, LineUart, Port
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import UartSetting

# Port settings of hosts that differ from those of the device.

_LOOK_US: Final = 500_000


class HostSetting:
    """Reports a host whose serial setting differs from the device's, once for each such setting.

    Args:
        read: function that returns the present setting of the host, such as `9600 8N1`.
        wanted: setting of the device, or empty if the device accepts any setting of the host.
        notify: function that is called with each setting of the host that differs.

    Attributes:
        differing: the present setting of the host if it differs from the device's, otherwise empty.
    """

    def __init__(self, read: Callable[[], str], wanted: str, notify: Callable[[str], None]) -> None:
        self._read, self._wanted, self._notify = read, wanted, notify
        self._notified: set[str] = set()
        self._next_us = 0
        self.differing = ""

    def want(self, wanted: str) -> None:
        """From now on, compare the host's setting with a new setting of the device.

        Args:
            wanted: new setting of the device, or empty if the device accepts any setting of the
                host.
        """
        if wanted != self._wanted:
            self._wanted, self._next_us = wanted, 0
            self._notified.clear()

    def look(self, now_us: int, *, at_once: bool = False) -> None:
        """Check whether the host's setting differs from the device's, at most twice a second.

        Args:
            now_us: present time in microseconds.
            at_once: true if the host has just acted. The check is then done even if the last check
                was less than half a second ago.
        """
        if now_us < self._next_us and not at_once:
            return
        self._next_us = now_us + _LOOK_US
        setting = self._read()
        self.differing = setting if self._wanted and setting != self._wanted else ""
        if self.differing and setting not in self._notified:
            self._notified.add(setting)
            self._notify(setting)


class Bridge:
    """A bridge between the far end of a line and the outside: a pty, a socket, a real port.

    The line keeps its baud rate: data written in one piece from outside arrive at the device byte
    by byte. Data that do not fit into the line's buffer stay in the buffer of the outside port
    until they fit.

    Args:
        end: host's end of the line.
        outside: port of the host.
        attend: function that is called with the time instead of a poll, while the line has no room
            for earlier data.
        changed: function that is called with the setting of the device, at the start and after each
            change. The setting is None if hosts of any setting understand the device.
    """

    def __init__(
        self,
        end: ByteEnd,
        outside: Port[bytes],
        attend: Callable[[int], object] = lambda now_us: None,
        changed: Callable[[UartSetting], object] | None = None,
    ) -> None:
        self._end, self._outside, self._attend = end, outside, attend
        self._changed, self._setting = changed or (lambda setting: None), end.uart.setting
        self._changed(self._setting)
        self._pending = b""
        self._looked_us = 0

    @property
    def due_us(self) -> int:
        """Time at which all bytes that are on the line now will have arrived at this end."""
        return self._end.idle_us

    def take_in(self, now_us: int) -> None:
        """Read the data that outside hosts have written, and send them on the emulated line.

        The exact time at which a host has written data is not known: it is after the last poll and
        before this poll. The data are sent as if the host had written them right after the last
        poll, so that the poll does not delay them by up to a tick.
        """
        if self._pending:
            self._attend(now_us)
        else:
            self._pending = self._outside.poll(now_us)
        if self._pending:
            # As of the last look: as of now, a line of 115 200 baud would lose the time of
            # 115 bytes in each tick of 10 ms.
            room = self._end.room(self._looked_us)
            self._end.send(self._looked_us, self._pending[:room])
            self._pending = self._pending[room:]
        self._looked_us = now_us

    def give_out(self, now_us: int) -> None:
        """Deliver the data that have arrived by now to the outside."""
        uart = self._end.uart
        if uart.setting != self._setting and uart.since_us <= now_us:
            if before := self._end.poll(uart.since_us):
                self._outside.send(now_us, before)
            self._setting = uart.setting
            self._changed(uart.setting)
        if data := self._end.poll(now_us):
            self._outside.send(now_us, data)


class HostEnd:
    """Wrapper of a host's end of a serial line that reports the bytes the host sends and receives.

    Args:
        end: the wrapped end.
        hear: function that is called with the time, the direction and the bytes.
    """

    def __init__(self, end: ByteEnd, hear: Callable[[int, Mark, bytes], None]) -> None:
        self._end, self._hear = end, hear

    def __reduce__(self) -> tuple[Callable[[ByteEnd], ByteEnd], tuple[ByteEnd]]:
        """Copy only the end, because a twin has no listeners."""
        return itself, (self._end,)

    @property
    def due_us(self) -> int:
        """Time at which the next byte will have arrived here."""
        return self._end.due_us

    @property
    def idle_us(self) -> int:
        """Time at which the last byte in transit to this end will have arrived."""
        return self._end.idle_us

    @property
    def coming(self) -> bytes:
        """The bytes in transit to this end that are known to arrive."""
        return self._end.coming

    def arrival_us(self, count: int) -> int:
        """Return the time at which to check whether `count` bytes have arrived at the host.

        If bytes are missing at this time, the caller calls this method again. If no bytes are in
        transit to the host, the result may be `NEVER`.
        """
        return self._end.arrival_us(count)

    @property
    def uart(self) -> LineUart:
        """The setting of the device on the line."""
        return self._end.uart

    def use_uart(self, now_us: int, setting: UartSetting) -> None:
        """Change the setting of the device at this end."""
        self._end.use_uart(now_us, setting)

    def withdraw(self, now_us: int) -> list[tuple[int, int]]:
        """Remove the host's bytes that have not arrived; return their starts (ps) and values."""
        return self._end.withdraw(now_us)

    @property
    def lost(self) -> int:
        """Number of bytes lost because of a full buffer."""
        return self._end.lost

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` accepts at `now_us` without loss."""
        return self._end.room(now_us)

    @property
    def sent_us(self) -> int:
        """Time at which the last byte of the host will have been sent.

        If all bytes have been sent, the result is a time in the past or `NEVER`, with the same
        meaning.
        """
        return self._end.sent_us

    def unsent(self, now_us: int) -> int:
        """Return how many bytes of the host have not been sent completely yet."""
        return self._end.unsent(now_us)

    def drop_unsent(self, now_us: int) -> None:
        """Discard the bytes of the host of which no bit has been sent yet."""
        self._end.drop_unsent(now_us)

    def poll(self, now_us: int, /) -> bytes:
        """Return the data of the device."""
        if data := self._end.poll(now_us):
            self._hear(now_us, Mark.FROM_DEVICE, data)
        return data

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Send data as the host."""
        self._hear(now_us, Mark.TO_DEVICE, traffic)
        self._end.send(now_us, traffic)


class Tap(Copyable, Generic[W]):
    """Wrapper of a port that reports all its traffic to listeners.

    The wrapped port is the device's end of a wire, or the port of the host. `poll` returns the data
    that go to the device, and `send` forwards the data that come from the device. A copy of the
    wrapper has no listeners.

    Args:
        port: the wrapped port.
        listeners: functions that are called with the time, the direction and the traffic.
    """

    def __init__(self, port: Port[W], *listeners: Callable[[int, Mark, W], None]) -> None:
        self._port = port
        self.listeners: Listeners[Callable[[int, Mark, W], None]] = Listeners(listeners)

    @property
    def due_us(self) -> int:
        """Time at which the next traffic arrives at the port."""
        return self._port.due_us

    def poll(self, now_us: int, /) -> W:
        """Return the traffic of the host."""
        if traffic := self._port.poll(now_us):
            self._hear(now_us, Mark.TO_DEVICE, traffic)
        return traffic

    def send(self, now_us: int, traffic: W, /) -> None:
        """Forward the traffic of the device."""
        if traffic:
            self._hear(now_us, Mark.FROM_DEVICE, traffic)
        self._port.send(now_us, traffic)

    @property
    def sent_us(self) -> int:
        """Time at which the line will have sent all data of this port.

        The result is `NEVER` if all data have been sent, or if the time is unknown.
        """
        return getattr(self._port, "sent_us", NEVER)

    def use_uart(self, now_us: int, setting: UartSetting) -> None:
        """Change the setting of the device at the other end."""
        self._port.use_uart(now_us, setting)  # type: ignore[attr-defined] # of a ByteEnd

    @property
    def uart(self) -> LineUart:
        """The setting of the device, if the port is an end of a line."""
        uart: LineUart = self._port.uart  # type: ignore[attr-defined] # of a ByteEnd
        return uart

    def _hear(self, now_us: int, mark: Mark, traffic: W) -> None:
        for hear in self.listeners:
            hear(now_us, mark, traffic)
