"""An emulated CAN bus in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.twin import Copyable, Listeners
from tickrig.emulators.can.bus_device import Accepted
from tickrig.emulators.can.end import Babbler, CanEnd
from tickrig.emulators.can.faults import CanFaults
from tickrig.emulators.can.segment import CanSegment
from tickrig.emulators.can.transmission_outcomes import Observer
from tickrig.wire.can import CanFrame

_BIT_RATES: Final = range(10_000, 1_000_001)
WINDOW_US: Final = 1_000_000
_BABBLER: Final = -1  # number of the node that the fault `babble` adds


@mypyc_attr(allow_interpreted_subclasses=True)
class CanWire(Copyable):
    r"""A classic CAN bus (ISO 11898-1); each node has a `CanEnd`.

    A frame takes exactly the time of its bits, including stuff bits. It is received and
    time-stamped after its end of frame. If several frames wait, the arbitration field decides. If
    several nodes send the same frame at the same time, the frame is sent once. If their frames have
    the same identifier but different contents, the nodes collide. An unacknowledged frame, or a
    frame broken by a fault, is sent again after the error frame. TEC and REC count as in ISO
    11898-1.

    Not emulated: propagation and bit timing (all nodes see a bit at once), overload frames, errors
    that only one receiver sees, reception of a node's own frames (a controller does not receive its
    own frames), CAN FD. A node that is alone and error-passive repeats its frame endlessly.
    Observers are not called for each repetition, and the bus load does not include the repetitions.

    Args:
        bit_rate: bit rate, 10 000 to 1 000 000 bit/s.
        seed: seed of the random numbers in faults.

    Attributes:
        bit_rate: bit rate in bit/s.
        bus: the bus of all connected ends.
        faults: armed faults. `arm` and `clear` act at the present time of the bus.
        observers: functions that are called with each frame and each error frame on the bus, and
            with its time.
        on_traffic: functions that are called when a frame may end earlier than the previous
            `due_us`.

    >>> wire = CanWire(bit_rate=500_000)
    >>> node, host = wire.end(), wire.end()
    >>> node.send(0, (CanFrame.parse("705#7F"),))
    >>> host.poll(109), host.poll(110)
    ((), (CanFrame(can_id=1797, data=b'\x7f', remote=False, extended=False, remote_length=0),))
    """

    def __init__(self, bit_rate: int = 1_000_000, seed: int = 0) -> None:
        if bit_rate not in _BIT_RATES:
            raise ValueError(
                f"bit rate {bit_rate} is not in {_BIT_RATES[0]}..{_BIT_RATES[-1]} bit/s"
            )
        self.bit_rate = bit_rate
        self.faults = CanFaults(seed, self._fault_changed)
        self.observers: Listeners[Observer] = Listeners()
        self.on_traffic: Listeners[Callable[[], None]] = Listeners()
        self.bus = CanSegment(bit_rate, 0, self.faults, self.observers, self.on_traffic)
        self._apart: dict[int, CanSegment] = {}  # ends that are disconnected, each by itself
        self._count = 0
        self._babbler: CanEnd | None = None

    def end(self, accepts: Accepted = None) -> CanEnd:
        """Connect another node to the bus, and return its connection.

        Args:
            accepts: CAN-IDs that the node receives, or None for all. A 29-bit CAN-ID has bit 29
                set.

        Returns:
            The connection of the node to the bus. A `Station` needs it as the port of the node.
        """
        end = CanEnd(self, self._count, accepts)
        self._count += 1
        self.bus.join(end, self.bus.now_us)
        return end

    @property
    def _kernel_bus(self) -> CanSegment | None:
        """The bus for code that advances the bus without the wire, or None in a derived class."""
        return self.bus if type(self) is CanWire else None

    @property
    def due_us(self) -> int:
        """End of the next frame."""
        if not self._apart:
            return self.bus.due_us
        return min(self.bus.due_us, *(apart.due_us for apart in self._apart.values()))

    def advance(self, now_us: int) -> None:
        """Advance the bus to a time, and deliver the frames that end by then.

        Args:
            now_us: time to which the bus advances, in microseconds.
        """
        self.bus.advance(now_us)
        if self._apart:
            for apart in self._apart.values():
                apart.advance(now_us)

    def advance_until_received(self, until_us: int) -> bool:
        """Advance the bus until a station has received a frame, at most to a given time.

        Args:
            until_us: latest time.

        Returns:
            True if a station has received a frame by then.
        """
        if not self._apart:
            return self.bus.advance_until_received(until_us)
        due_us = self.due_us
        self.advance(min(due_us, until_us))
        return due_us <= until_us

    def load_permille(self, window_us: int = WINDOW_US) -> int:
        """Return the load of the bus: the share of a time window in which the bus was busy.

        Args:
            window_us: length of the window in microseconds, at most a second. It ends now.

        Returns:
            The load in 0.1 %.
        """
        bus = self.bus
        now = bus.now_us * bus.unit
        first = max(0, now - window_us * bus.unit)
        return bus.busy.permille(first, now, bus.present)

    def disconnect(self, end: CanEnd) -> None:
        """Unplug a node from the bus. Its frames are then neither received nor acknowledged.

        Args:
            end: connection of the node to the bus.
        """
        if end.number not in self._apart:
            now_us = self.bus.now_us
            self.bus.leave(end, now_us)
            faults = CanFaults(0, _ignore)
            apart = CanSegment(self.bit_rate, now_us, faults, Listeners(), self.on_traffic)
            self._apart[end.number] = apart
            self.bus.whole = False
            apart.join(end, now_us)

    def reconnect(self, end: CanEnd) -> None:
        """Plug a node in again.

        Args:
            end: connection of the node to the bus.
        """
        apart = self._apart.pop(end.number, None)
        if apart is not None:
            apart.leave(end, self.bus.now_us)
            self.bus.join(end, self.bus.now_us)
            self.bus.whole = not self._apart

    def cut_power(self, end: CanEnd) -> None:
        """Cut the power of a node: its waiting frames are lost, and its CAN controller is reset.

        Args:
            end: connection of the node to the bus.
        """
        self.disconnect(end)
        apart, now_us = self._apart[end.number], self.bus.now_us
        apart.leave(end, now_us)
        end.forget()
        end.controller.restart()
        end.open(on_bus=True)
        apart.join(end, now_us)

    def force_off(self, end: CanEnd) -> None:
        """Force a node bus-off until `release`.

        Args:
            end: connection of the node to the bus.
        """
        end.auto_recovery = False
        end.segment.force_off(end, self.bus.now_us)

    def release(self, end: CanEnd) -> None:
        """Let a node recover from the bus-off into which `force_off` has put it.

        From then on the node recovers from bus-off automatically, as with most drivers.

        Args:
            end: connection of the node to the bus.
        """
        end.auto_recovery = True
        end.recover(self.bus.now_us)

    def _fault_changed(self, name: str, armed: bool) -> None:
        now_us = self.bus.now_us
        if name == "short":
            self.bus.shorted = armed
        elif name == "babble":
            self._babble(now_us, armed=armed)
        self.bus.disturb(now_us)

    def _babble(self, now_us: int, *, armed: bool) -> None:
        if armed:
            self._babbler = Babbler(self, _BABBLER, frozenset())
            self._babbler.enqueue((CanFrame(0),))
            self.bus.join(self._babbler, now_us)
        elif self._babbler is not None:
            self.bus.leave(self._babbler, now_us)
            self._babbler = None


def _ignore(name: str, armed: bool) -> None:
    """Ignore changes of faults, because a disconnected segment has no faults."""
