"""A link of a host, with a watch at it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Generic

from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.real.door_watch import DoorWatch
from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.link import Link, StampedFrames, StampedLink, W
from tickrig.host.text.trace import Mark
from tickrig.wire.can import Frames


class LinkGone(PortGone, LinkClosed):
    """The port of a link is there no more; for hosts, the line is closed."""


class WatchedLink(Generic[W]):
    """A `Link` that tells what passes, and how long its waits in vain took.

    Args:
        link: the link behind it.
        watch: is told.
    """

    def __init__(self, link: Link[W], watch: DoorWatch) -> None:
        self._link, self._watch, self._closed = link, watch, False

    @property
    def now_us(self) -> int:
        """The clock of the link behind it."""
        return self._link.now_us

    def send(self, traffic: W, /) -> None:
        """Send traffic.

        Raises:
            LinkGone: the port is there no more.
            LinkClosed: the link was closed.
        """
        self._watch.used()
        with self._told_if_gone(), self._watch.sending(traffic):
            self._link.send(traffic)
        self._watch.passed(Mark.TO_DEVICE, traffic)

    def receive(self, timeout_us: int, /) -> W:
        """Return what arrived, or empty traffic after `timeout_us`.

        Raises:
            LinkGone: the port is there no more.
            LinkClosed: the link was closed.
        """
        self._watch.used()
        begun_us = self.now_us
        with self._told_if_gone():
            traffic = self._link.receive(timeout_us)
        self._took(timeout_us, begun_us, traffic)
        return traffic

    def close(self) -> None:
        """Close the link behind it."""
        self._closed = True
        self._link.close()

    def _took(self, wanted_us: int, begun_us: int, traffic: W) -> None:
        if traffic:
            self._watch.passed(Mark.FROM_DEVICE, traffic)
        else:
            self._watch.waited(wanted_us, self.now_us - begun_us)

    @contextmanager
    def _told_if_gone(self) -> Iterator[None]:
        """Tell a port that is gone from a line that the host has closed."""
        try:
            yield
        except LinkClosed as error:
            if self._closed:
                raise
            raise LinkGone(str(error)) from error


class WatchedFrameLink(WatchedLink[Frames]):
    """A `StampedLink` with a watch at it.

    Args:
        link: the link behind it.
        watch: is told.
    """

    def __init__(self, link: StampedLink, watch: DoorWatch) -> None:
        super().__init__(link, watch)
        self._stamped = link

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Wait for a first frame; return a time, and all that had arrived by then.

        Raises:
            LinkGone: the bus is there no more.
            LinkClosed: the link was closed.
        """
        self._watch.used()
        begun_us = self.now_us
        with self._told_if_gone():
            now_us, received = self._stamped.receive_stamped(timeout_us)
        self._took(timeout_us, begun_us, tuple(frame for _, frame in received))
        return now_us, received
