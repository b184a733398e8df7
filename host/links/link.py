"""Links: how a proxy reaches its device, emulated or real."""

from __future__ import annotations

from typing import Protocol, TypeVar

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
