"""A CAN link to a real bus, or any other that python-can knows."""

from __future__ import annotations

import time

import can

from tickrig.host.can_message import to_frame, to_message
from tickrig.host.errors import LinkClosed
from tickrig.wire.can import CanFrame, Frames

SEND_TIMEOUT_S = 1


class CanLink:
    """A `Link[Frames]` over python-can.

    Error frames and CAN FD frames that arrive are passed over.

    Args:
        channel: which bus of the interface, as `can0`.
        interface: python-can's name of the adapter's kind, as `socketcan`.
        bit_rate: bits a second, where the interface sets it.

    Raises:
        LinkClosed: the bus cannot be opened.
    """

    def __init__(self, channel: str, interface: str, bit_rate: int | None = None) -> None:
        self._name = f"{interface}:{channel}"
        try:
            self._bus = _open(channel, interface, bit_rate)
        except (can.CanError, OSError, ValueError, ImportError, AttributeError) as error:
            raise LinkClosed(f"cannot open {self._name}: {error}") from error

    @property
    def now_us(self) -> int:
        """The machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def send(self, traffic: Frames, /) -> None:
        """Send frames; raises LinkClosed if the bus is gone or takes none for 1 s."""
        try:
            for frame in traffic:
                self._bus.send(to_message(frame), SEND_TIMEOUT_S)
        except (can.CanError, OSError, ValueError) as error:
            raise LinkClosed(f"cannot send on {self._name}: {error}") from error

    def receive(self, timeout_us: int, /) -> Frames:
        """Wait for a first frame, then return all that are there."""
        deadline_us = self.now_us + timeout_us
        frames: list[CanFrame] = []
        try:
            while not frames:
                wait_us = max(0, deadline_us - self.now_us)
                message = self._bus.recv(wait_us / 1e6)
                if message is None and not wait_us:
                    break
                while message is not None:
                    frame = to_frame(message)
                    frames += (frame,) if frame is not None else ()
                    message = self._bus.recv(0)
        except (can.CanError, OSError) as error:
            raise LinkClosed(f"cannot read from {self._name}: {error}") from error
        return tuple(frames)

    def close(self) -> None:
        """Close the bus."""
        self._bus.shutdown()


def _open(channel: str, interface: str, bit_rate: int | None) -> can.BusABC:
    if bit_rate is None:
        return can.Bus(channel=channel, interface=interface)
    return can.Bus(channel=channel, interface=interface, bitrate=bit_rate)
