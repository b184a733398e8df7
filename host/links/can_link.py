"""A CAN link to a real bus, or any other that python-can knows."""

from __future__ import annotations

import errno
import time
from collections.abc import Callable
from typing import Any

import can

from tickrig.host.links.can_message import to_frame, to_message
from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.multicast_group import keep_to_group
from tickrig.host.links.stamp_clock import StampClock
from tickrig.host.links.stamped_link import Stamped
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.can_error import CONTROLLER_BYTE, ControllerFlag, ErrorClass, ErrorState

SEND_TIMEOUT_S = 1
PASSIVE = ControllerFlag.RECEIVE_PASSIVE | ControllerFlag.TRANSMIT_PASSIVE


class CanLink:
    """A `StampedLink` over python-can.

    CAN FD frames that arrive are passed over, and error frames but for what
    they say of the error state.

    Args:
        bus: an open bus; nobody else may read from it.
        name: what people call it.
        drops: go on, without a wait, when the bus takes no frame; the frame is lost.

    Attributes:
        lost: frames that the bus did not take.
        on_error_state: told the error state of the controller, where the driver says it.
    """

    def __init__(self, bus: can.BusABC, name: str, *, drops: bool = False) -> None:
        self._bus, self._name, self._drops, self.lost = bus, name, drops, 0
        self.on_error_state: Callable[[ErrorState], None] | None = None
        self._stamps, self._looked_us = StampClock(), self.now_us

    @classmethod
    def open(cls, channel: str, interface: str, bit_rate: int | None = None) -> CanLink:
        """Open a bus.

        Args:
            channel: which bus of the interface, as `can0`.
            interface: python-can's name of the adapter's kind, as `socketcan`.
            bit_rate: bits a second, where the interface sets it.

        Raises:
            LinkClosed: the bus cannot be opened.
        """
        name = f"{interface}:{channel}"
        try:
            return cls(_open(channel, interface, bit_rate), name)
        except (can.CanError, OSError, ValueError, ImportError, AttributeError) as error:
            raise LinkClosed(f"cannot open {name}: {error}") from error

    @property
    def now_us(self) -> int:
        """The machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def send(self, traffic: Frames, /) -> None:
        """Send frames; raises LinkClosed if the bus is gone or takes none for 1 s."""
        for frame in traffic:
            try:
                self._bus.send(to_message(frame), 0 if self._drops else SEND_TIMEOUT_S)
            except (can.CanError, OSError, ValueError) as error:
                if not (self._drops and _is_full(error)):
                    raise LinkClosed(f"cannot send on {self._name}: {error}") from error
                self.lost += 1

    def receive(self, timeout_us: int, /) -> Frames:
        """Wait for a first frame, then return all that are there."""
        return tuple(frame for _, frame in self.hear(timeout_us)[1])

    def hear(self, timeout_us: int, /) -> tuple[int, Stamped]:
        """Wait for a first frame; return a time, and all that had arrived by then.

        The time is of before the last look: a process that is stopped behind it knows
        itself late, and takes nobody for silent.
        """
        deadline_us = self.now_us + timeout_us
        heard: list[tuple[int, CanFrame]] = []
        while True:
            now_us = self.now_us
            wait_us = 0 if heard else max(0, deadline_us - now_us)
            message = self._read(wait_us)
            if message is not None:
                heard += self._take(message)
            elif not wait_us:
                self._looked_us = now_us
                return now_us, tuple(heard)

    def close(self) -> None:
        """Close the bus."""
        self._bus.shutdown()

    def _read(self, wait_us: int) -> can.Message | None:
        try:
            return self._bus.recv(wait_us / 1e6)
        except (can.CanError, OSError) as error:
            raise LinkClosed(f"cannot read from {self._name}: {error}") from error

    def _take(self, message: can.Message) -> Stamped:
        if message.is_error_frame:
            state = _error_state(message)
            if state is not None and self.on_error_state is not None:
                self.on_error_state(state)
        if (frame := to_frame(message)) is None:
            return ()
        return ((self._stamps.at_us(message.timestamp, self._looked_us, self.now_us), frame),)


def _open(channel: str, interface: str, bit_rate: int | None) -> can.BusABC:
    given: dict[str, Any] = {} if bit_rate is None else {"bitrate": bit_rate}
    bus = can.Bus(channel=channel, interface=interface, **given)
    keep_to_group(bus, interface)
    return bus


def _is_full(error: Exception) -> bool:
    """Say whether nobody took the frames before: no other node, no plug, bus-off."""
    if isinstance(error, can.CanOperationError):
        return error.error_code in (None, errno.ENOBUFS, errno.EAGAIN)
    return isinstance(error, OSError) and error.errno in (errno.ENOBUFS, errno.EAGAIN)


def _error_state(message: can.Message) -> ErrorState | None:
    """Return the error state that an error frame of SocketCAN tells, None if it tells none."""
    error = ErrorClass(message.arbitration_id & 0x1FF)
    if ErrorClass.BUS_OFF in error:
        return ErrorState.BUS_OFF
    if ErrorClass.RESTARTED in error:
        return ErrorState.ACTIVE
    if ErrorClass.CONTROLLER not in error or len(message.data) <= CONTROLLER_BYTE:
        return None
    flags = ControllerFlag(message.data[CONTROLLER_BYTE] & 0x7F)
    if flags & PASSIVE:
        return ErrorState.PASSIVE
    return ErrorState.ACTIVE if ControllerFlag.ACTIVE in flags else None
