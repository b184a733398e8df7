"""Links: how a proxy reaches its device, emulated or real."""

from __future__ import annotations

from typing import Protocol, TypeVar

from tickrig.wire.can import CanFrame, Frames

W = TypeVar("W")  # traffic: bytes on a line, tuple[CanFrame, ...] on CAN


class Link(Protocol[W]):
    """A wire as a proxy sees it, with the clock that runs on it.

    A proxy takes the time from its link and never from the machine: on a rig
    in virtual time the same proxy waits a minute in a millisecond.
    """

    @property
    def now_us(self) -> int:
        """Time on this link's clock in microseconds; only differences mean anything."""
        ...

    def send(self, traffic: W, /) -> None:
        """Send traffic.

        Raises:
            LinkClosed: the line is gone.
        """

    def receive(self, timeout_us: int, /) -> W:
        """Return what arrived, or empty traffic after `timeout_us`.

        Raises:
            LinkClosed: the line is gone.
        """
        ...

    def close(self) -> None:
        """Give the line back; closing twice is no error."""


StampedFrames = tuple[tuple[int, CanFrame], ...]
"""Frames, each with the time at which it had ended on the bus, on the clock of its link."""


class StampedLink(Link[Frames], Protocol):
    """A link to a CAN bus for who judges silence: late reading is no silence of the bus."""

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Wait for a first frame; return a time, and all that had arrived by then.

        Raises:
            LinkClosed: the bus is gone.
        """
        ...
