"""A link that is opened again after its line has gone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic

from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.link import Link, W


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
