"""Links: how a proxy reaches its device, emulated or real, and how one fails and closes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Final, Generic, Protocol, Self, TypeVar

from tickrig.wire.can import CanFrame, Frames

# What a host says about a link or a device.
#
# LinkError
#  +-- LinkTimeout (TimeoutError)      no answer in time
#  +-- LinkClosed (ConnectionError)    the line is gone: cable out, emulator ended
# DeviceRefused                        the device answered, and said no

TRACEBACK: Final = "Traceback (most recent call last)"
"""Some drivers put one into the text of what they raise."""


def first_line(error: BaseException) -> str:
    r"""Return the text of an error in a line, without a traceback; its type if there is none.

    >>> first_line(ValueError("bad frame\nTraceback (most recent call last):\n  File x"))
    'bad frame'
    >>> first_line(OSError())
    'OSError'
    """
    text = " ".join(str(error).partition(TRACEBACK)[0].split())
    return text or type(error).__name__


class LinkError(Exception):
    """The link to a device failed."""


class LinkTimeout(LinkError, TimeoutError):  # noqa: N818 - a timeout, as the built-in calls it
    """The device did not answer in time."""


class LinkClosed(LinkError, ConnectionError):  # noqa: N818 - a state of the link
    """The line is gone: cable out, port closed, emulator ended."""


class DeviceRefused(Exception):  # noqa: N818 - what the device did
    """The device answered, and refused.

    Args:
        message: what people read.
        code: what the device gave as its reason.

    Attributes:
        code: what the device gave as its reason, in its own notation.
    """

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code


# Links: how a proxy reaches its device, emulated or real.

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


# What a `with` block closes at its end.


class Closing(ABC):
    """Something that a `with` block closes at its end, however it ends."""

    @abstractmethod
    def close(self) -> None:
        """Give everything back."""

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()


# A link that is opened again after its line has gone.


class ReopeningLink(Generic[W]):
    """A `Link` over links of which each is used until its line is gone.

    A line that is gone says so to its caller, as every link does. Each `send`
    after that tries to open it again: a cable may come back, an emulator may
    be started again.

    Args:
        open_link: opens the line; called at once.

    Raises:
        LinkClosed: the line cannot be opened.
    """

    def __init__(self, open_link: Callable[[], Link[W]]) -> None:
        self._open_link, self._link = open_link, open_link()
        self._gone = self._closed = False

    @property
    def now_us(self) -> int:
        """Time on the clock of the link, also while its line is gone."""
        return self._link.now_us

    def send(self, traffic: W, /) -> None:
        """Send traffic, on a new link if the line was gone; LinkClosed if it is."""
        # Only sending opens again: a reader in a loop would try as often as it looks.
        if self._gone and not self._closed:
            self._link, self._gone = self._open_link(), False
        try:
            self._link.send(traffic)
        except LinkClosed:
            self._leave()
            raise

    def receive(self, timeout_us: int, /) -> W:
        """Return what arrived, or empty traffic after `timeout_us`; LinkClosed if it is gone."""
        try:
            return self._link.receive(timeout_us)
        except LinkClosed:
            self._leave()
            raise

    def close(self) -> None:
        """Give the line back, for good."""
        self._closed = True
        self._leave()

    def _leave(self) -> None:
        self._gone = True
        self._link.close()
