"""Ports: ends of wires, of devices and of whoever is outside."""

from __future__ import annotations

from collections.abc import Callable, Sized
from typing import Protocol

from tickrig.device.core import W
from tickrig.device.twin import Part
from tickrig.host.text.trace import Mark
from tickrig.wire.uart import UartSetting


class Port(Protocol[W]):
    """One end of a wire. It never blocks, and time is an argument."""

    @property
    def due_us(self) -> int:
        """When the next traffic will have arrived, `NEVER` if none is on its way."""
        ...

    def poll(self, now_us: int, /) -> W:
        """Take all that has arrived by `now_us` and was not taken before, in wire order."""
        ...

    def send(self, now_us: int, traffic: W, /) -> None:
        """Put one tick's traffic on the wire at `now_us`."""


class LineUart(Part):
    """The setting of the device on a line.

    Args:
        setting: the first setting.

    Attributes:
        setting: the setting, with the latest change.
        since_us: from when on it counts.
        listeners: called with that time and the new setting; they are copied with the line.
        error_listeners: called with characters that a fault has spoiled: which way they went, the
            error that a UART sees (`framing`, `parity`, `breaks`), and how many; copied, too.
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
        """Change the setting of the device at this end, behind the last stop bit it has sent."""

    def withdraw(self, now_us: int) -> list[tuple[int, int]]:
        """Take bytes sent from here that have not arrived off the line: start in ps, value."""
        ...

    @property
    def idle_us(self) -> int:
        """When the last byte that is on its way here will have arrived."""
        ...

    @property
    def coming(self) -> bytes:
        """What is on its way here and was not taken, as far as it is known to arrive."""
        ...

    def arrival_us(self, count: int) -> int:
        """Return when so many bytes will have arrived, or when to look again; `NEVER` for none."""
        ...

    @property
    def lost(self) -> int:
        """Bytes that found a buffer full."""
        ...

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` takes at `now_us` without loss."""
        ...

    @property
    def sent_us(self) -> int:
        """When the last byte sent from here will have passed; past or `NEVER` if it has."""
        ...

    def unsent(self, now_us: int) -> int:
        """Return how many bytes sent from here have not passed yet."""
        ...

    def drop_unsent(self, now_us: int) -> None:
        """Forget the bytes sent from here of which no bit is on the line yet."""


class ByteLine(Protocol):
    """An emulated serial line with two ends or more; the device is at the first."""

    @property
    def a(self) -> ByteEnd:
        """The device's end."""
        ...

    @property
    def b(self) -> ByteEnd:
        """The host's end."""
        ...


class Wire(Protocol):
    """A wire that many stations share; it is moved on by the rig."""

    @property
    def due_us(self) -> int:
        """When something ends on it next, `NEVER` if nothing is on its way."""
        ...

    @property
    def on_traffic(self) -> list[Callable[[], None]]:
        """Whom to call when something may end on it earlier than it said."""
        ...

    @property
    def observers(self) -> Sized:
        """Who hears of all that ends on it."""
        ...

    def advance(self, now_us: int, /) -> None:
        """Let everything end that ends by `now_us`, and wake who received it."""

    def advance_until_received(self, until_us: int, /) -> bool:
        """Let things end until a station was woken; False if none was by `until_us`."""
        ...


class OutsideBridge(Protocol):
    """A bridge between a wire and the outside world: `Bridge`, `CanBridge`."""

    @property
    def due_us(self) -> int:
        """When there is something to be handed out."""
        ...

    def take_in(self, now_us: int, /) -> None:
        """Put on the wire what the outside sent."""

    def give_out(self, now_us: int, /) -> None:
        """Hand out what has arrived."""


class Host(Protocol):
    """An end of a wire at which no station is, but somebody who waits."""

    @property
    def wire(self) -> Wire:
        """The wire it is an end of."""
        ...

    @property
    def arrived_us(self) -> int:
        """When what waits there had arrived, `NEVER` if nothing does."""
        ...
