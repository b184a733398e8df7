"""Ports: one device's end of a wire, or of the outside world."""

from __future__ import annotations

from typing import Protocol

from tickrig.device.core import W


class Port(Protocol[W]):
    """One end of a wire. It never blocks, and time is an argument."""

    @property
    def due_us(self) -> int:
        """When the next traffic will have arrived, `NEVER` if none is on its way."""
        ...

    def poll(self, now_us: int, /) -> W:
        """Take all that has arrived by `now_us` and was not taken before, in wire order."""
        ...

    def send(self, now_us: int, traffic: W, /) -> None:
        """Put one tick's traffic on the wire at `now_us`."""
