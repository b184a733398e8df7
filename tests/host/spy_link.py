"""Links around another one: one keeps what passes and spoils it, one delivers late."""

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


class LateLink:
    """A `Link[bytes]` that holds back what a device answers in one stretch of time.

    With `stopped` the host itself does nothing in that time, as a process that gets no processor.
    """

    def __init__(
        self, link: Link[bytes], from_us: int, to_us: int, *, stopped: bool = False
    ) -> None:
        self._link, self._from_us, self._to_us, self._held = link, from_us, to_us, b""
        self._stopped = stopped
        self.send, self.close = link.send, link.close

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def receive(self, timeout_us: int, /) -> bytes:
        until_us = self.now_us + timeout_us
        if self.now_us < self._from_us:
            return self._link.receive(timeout_us)
        if self._stopped and self.now_us < self._to_us:
            until_us = max(until_us, self._to_us)
        while self.now_us < min(until_us, self._to_us):
            self._held += self._link.receive(min(until_us, self._to_us) - self.now_us)
        if self.now_us < self._to_us:
            return b""
        held, self._held = self._held, b""
        return held or self._link.receive(until_us - self.now_us)
