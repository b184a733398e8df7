"""Links between a proxy and its device, emulated or real, and their errors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Final, Generic, Protocol, Self, TypeVar

from tickrig.wire.can import CanFrame, Frames

# Errors of links and devices.
#
# LinkError
#  +-- LinkTimeout (TimeoutError)      no answer in time
#  +-- LinkClosed (ConnectionError)    the line is gone: cable out, emulator ended
# DeviceRefused                        the device answered, and said no

TRACEBACK: Final = "Traceback (most recent call last)"
"""Start of a traceback, which some drivers put into the text of exceptions."""


def first_line(error: BaseException) -> str:
    r"""Return the text of an exception in one line, without an embedded traceback.

    If the exception has no text, return the name of its type.

    >>> first_line(ValueError("bad frame\nTraceback (most recent call last):\n  File x"))
    'bad frame'
    >>> first_line(OSError())
    'OSError'
    """
    text = " ".join(str(error).partition(TRACEBACK)[0].split())
    return text or type(error).__name__


class LinkError(Exception):
    """The link to a device failed."""

    __module__ = "tickrig.host"


class LinkTimeout(LinkError, TimeoutError):  # noqa: N818 - a timeout, as the built-in calls it
    """The device did not answer in time."""

    __module__ = "tickrig.host"


class LinkClosed(LinkError, ConnectionError):  # noqa: N818 - a state of the link
    """Raised if a connection is lost: unplugged cable, closed port, or ended emulator."""

    __module__ = "tickrig.host"


class DeviceRefused(Exception):  # noqa: N818 - what the device did
    """Raised by a proxy if the device refuses a request.

    Args:
        message: text of the refusal for the user.
        code: reason code given by the device.

    Attributes:
        code: reason code given by the device, in the notation of the device.
    """

    __module__ = "tickrig.host"

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code


# Links between a proxy and its device, emulated or real.

W = TypeVar("W")  # traffic: bytes on a line, tuple[CanFrame, ...] on CAN


class Link(Protocol[W]):
    """Connection between a proxy and its device, which may be real or emulated, with a clock.

    A proxy is the host's object for a device. The proxy reads the time from its link, never from
    the clock of the machine. So a proxy also works with an emulated device in virtual time. It then
    waits for a minute of virtual time within a millisecond of real time.
    """

    @property
    def now_us(self) -> int:
        """Time on the clock of this link in microseconds, for computing differences."""
        ...

    def send(self, traffic: W, /) -> None:
        """Send traffic.

        Raises:
            LinkClosed: the line is gone.
        """

    def receive(self, timeout_us: int, /) -> W:
        """Wait for traffic up to `timeout_us` microseconds. The result is empty after the timeout.

        Raises:
            LinkClosed: the connection is lost.
        """
        ...

    def close(self) -> None:
        """Close the line. Closing it again has no effect."""


StampedFrames = tuple[tuple[int, CanFrame], ...]
"""Frames, each with the time of its end on the bus, on the clock of its link."""


class StampedLink(Link[Frames], Protocol):
    """Link to a CAN bus that returns each received frame with its arrival time.

    The arrival times show whether the bus was silent, or the host read the frames late.
    """

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Wait for the next frame, then return all received frames with their arrival times.

        The first returned value is the time up to which the bus was read. The second value contains
        the frames that had arrived by this time.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        ...


# Objects closed by a `with` block.


class Closing(ABC):
    """An object that a `with` block closes at its end, also after an exception."""

    @abstractmethod
    def close(self) -> None:
        """Release all resources."""

    def __enter__(self) -> Self:
        """Return the object."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the object."""
        self.close()


# A link that is reopened after its line was lost.


class ReopeningLink(Generic[W]):
    """Link that reconnects by itself after its connection was lost.

    A lost connection raises LinkClosed once, as in every link. After that, each `send` first tries
    to connect again, for example to a cable that was plugged in again or an emulator that was
    restarted.

    Args:
        open_link: function that opens the connection. It is called at once, and for each new
            attempt.

    Raises:
        LinkClosed: the first connection cannot be opened.
    """

    def __init__(self, open_link: Callable[[], Link[W]]) -> None:
        self._open_link, self._link = open_link, open_link()
        self._gone = self._closed = False

    @property
    def now_us(self) -> int:
        """Time on the clock of the link in microseconds, also while the connection is lost."""
        return self._link.now_us

    def send(self, traffic: W, /) -> None:
        """Send traffic. If the connection was lost, connect again first.

        Raises:
            LinkClosed: the connection is lost now, or cannot be opened again.
        """
        # Only sending opens again: a reader in a loop would try as often as it looks.
        if self._gone and not self._closed:
            self._link, self._gone = self._open_link(), False
        try:
            self._link.send(traffic)
        except LinkClosed:
            self._leave()
            raise

    def receive(self, timeout_us: int, /) -> W:
        """Wait for traffic up to `timeout_us` microseconds. The result is empty after the timeout.

        Raises:
            LinkClosed: the connection is lost.
        """
        try:
            return self._link.receive(timeout_us)
        except LinkClosed:
            self._leave()
            raise

    def close(self) -> None:
        """Close the line permanently."""
        self._closed = True
        self._leave()

    def _leave(self) -> None:
        self._gone = True
        self._link.close()
