"""Ports: ends of wires at devices and hosts."""

from __future__ import annotations

from collections.abc import Callable, Sized
from typing import Protocol

from tickrig.device.core import W
from tickrig.device.twin import Part
from tickrig.host.text.trace import Mark
from tickrig.wire.uart import UartSetting


class Port(Protocol[W]):
    """Interface of one end of a wire, at which a device or host sends and receives.

    A port never blocks. Its methods get the present time as an argument.
    """

    @property
    def due_us(self) -> int:
        """Time at which the next traffic arrives at this end, or `NEVER` if there is none."""
        ...

    def poll(self, now_us: int, /) -> W:
        """Return the traffic that has arrived between the last call and `now_us`, in its order."""
        ...

    def send(self, now_us: int, traffic: W, /) -> None:
        """Send the traffic of one tick on the wire at `now_us`."""


class LineUart(Part):
    """The UART setting of the device on a serial line, with listeners to its changes.

    If the line is copied, for example with its bench, the copy has the same listeners.

    Args:
        setting: the initial setting.

    Attributes:
        setting: the setting after the latest change.
        since_us: time from which the present setting applies, in microseconds.
        listeners: functions that are called with `since_us` and the new setting.
        error_listeners: functions that are called when a fault has spoiled characters. They get the
            direction, the error that a UART detects (`framing`, `parity`, `breaks`), and the number
            of characters.
    """

    def __init__(self, setting: UartSetting) -> None:
        self.setting, self.since_us = setting, 0
        self.listeners: list[Callable[[int, UartSetting], None]] = []
        self.error_listeners: list[Callable[[Mark, str, int], None]] = []


class ByteEnd(Port[bytes], Protocol):
    """One end of an emulated serial line."""

    @property
    def uart(self) -> LineUart:
        """The setting of the device on the line."""
        ...

    def use_uart(self, now_us: int, setting: UartSetting) -> None:
        """Change the setting of the device at this end, after its last stop bit."""

    def withdraw(self, now_us: int) -> list[tuple[int, int]]:
        """Remove sent bytes that have not arrived; return their starts (ps) and values."""
        ...

    @property
    def idle_us(self) -> int:
        """Time at which the last byte in transit to this end will have arrived."""
        ...

    @property
    def coming(self) -> bytes:
        """The bytes in transit to this end that are known to arrive."""
        ...

    def arrival_us(self, count: int) -> int:
        """Return the time at which to check whether `count` bytes have arrived at this end.

        If the arrival time is known, the result is this time. Otherwise it is an earlier time, and
        the caller checks at this time and calls the method again. If no bytes are in transit, the
        result may be `NEVER`.
        """
        ...

    @property
    def lost(self) -> int:
        """Number of bytes lost because of a full buffer."""
        ...

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` accepts at `now_us` without loss."""
        ...

    @property
    def sent_us(self) -> int:
        """Time at which the last byte from this end will have been sent.

        If all bytes have been sent, the result is a time in the past or `NEVER`, with the same
        meaning.
        """
        ...

    def unsent(self, now_us: int) -> int:
        """Return how many bytes of this end have not been sent completely yet."""
        ...

    def drop_unsent(self, now_us: int) -> None:
        """Discard the bytes of this end of which no bit has been sent yet."""


class ByteLine(Protocol):
    """Protocol of an emulated serial line with two or more ends; the device is at the first end."""

    @property
    def a(self) -> ByteEnd:
        """The device's end."""
        ...

    @property
    def b(self) -> ByteEnd:
        """The host's end."""
        ...


class Wire(Protocol):
    """A wire shared by many stations and advanced by the rig."""

    @property
    def due_us(self) -> int:
        """Time at which the next transmission ends, or `NEVER` if there is none."""
        ...

    @property
    def on_traffic(self) -> list[Callable[[], None]]:
        """Callback for a transmission that may end earlier than the previous `due_us`."""
        ...

    @property
    def observers(self) -> Sized:
        """Callbacks for each transmission that ends."""
        ...

    def advance(self, now_us: int, /) -> None:
        """Advance to `now_us`, and wake the receivers."""

    def advance_until_received(self, until_us: int, /) -> bool:
        """Advance the wire until arriving traffic wakes a device of the rig.

        Returns False if no device was woken by `until_us`.
        """
        ...


class OutsideBridge(Protocol):
    """A bridge between a wire and the outside world: `Bridge`, `CanBridge`."""

    @property
    def due_us(self) -> int:
        """The time of the next delivery."""
        ...

    def take_in(self, now_us: int, /) -> None:
        """Send on the wire what came from outside."""

    def give_out(self, now_us: int, /) -> None:
        """Deliver the arrived traffic to the outside."""


class Host(Protocol):
    """An end of a wire with a waiting host instead of a station."""

    @property
    def wire(self) -> Wire:
        """The wire."""
        ...

    @property
    def arrived_us(self) -> int:
        """Arrival time of the waiting traffic, or `NEVER` if there is none."""
        ...
