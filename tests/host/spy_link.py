"""A link that keeps what passes, and lets a test spoil it."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.host.links.link import Link


class SpyLink:
    """A `Link[bytes]` around another one.

    Attributes:
        sent: what the host sent, and when.
        heard: all that came back.
        spoil: what happens to each line on its way to the device; returning
            nothing loses it.
    """

    def __init__(self, link: Link[bytes]) -> None:
        self._link = link
        self.sent: list[tuple[int, bytes]] = []
        self.heard = b""
        self.spoil: Callable[[bytes], bytes] = lambda line: line

    @property
    def now_us(self) -> int:
        return self._link.now_us

    @property
    def lines(self) -> list[bytes]:
        """The lines that were sent, without LF."""
        return [line.removesuffix(b"\n") for _, line in self.sent]

    def send(self, traffic: bytes, /) -> None:
        self.sent.append((self.now_us, traffic))
        if spoilt := self.spoil(traffic):
            self._link.send(spoilt)

    def receive(self, timeout_us: int, /) -> bytes:
        data = self._link.receive(timeout_us)
        self.heard += data
        return data

    def close(self) -> None:
        self._link.close()
