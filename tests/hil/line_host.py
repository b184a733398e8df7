"""A host on a serial line that sends something and reads an answer, whole or not at all."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from tickrig import Bench

T = TypeVar("T")

PATIENCE = "2s"
"""For what takes a device milliseconds."""


class LineHost:
    """Sends bytes and waits for an answer.

    Args:
        bench: where the device is.

    Attributes:
        heard: what came and was no answer yet.
    """

    def __init__(self, bench: Bench) -> None:
        self.bench, self._link, self.heard = bench, bench.link, b""

    def send(self, data: bytes) -> None:
        """Send."""
        self._link.send(data)

    def listen(self) -> bytes:
        """Return what has come and was no answer yet."""
        self.heard += self._link.receive(0)
        return self.heard

    def answer(self, take: Callable[[bytes], tuple[T, bytes] | None]) -> T:
        """Wait for an answer.

        Args:
            take: returns the answer and the rest, None while it is not whole.
        """
        found: list[tuple[T, bytes]] = []

        def look() -> bool:
            found.extend(each for each in [take(self.listen())] if each is not None)
            return bool(found)

        assert self.bench.wait_until(look, within=PATIENCE), f"no answer in {self.heard!r}"
        answer, self.heard = found[0]
        return answer
