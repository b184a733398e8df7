"""The rule about bus load."""

from __future__ import annotations

from tickrig.host.monitor.traffic.load import WINDOW_US, Window


class MaxLoad:
    """No second of a bus is busier.

    Args:
        percent: of the bit rate.
        bit_rate: bits a second.

    Attributes:
        name: as findings have it.
    """

    name = "max-load"

    def __init__(self, percent: float, bit_rate: int) -> None:
        self._percent, self._bit_rate = percent, bit_rate

    def judge(self, channel: str, window: Window) -> str | None:
        """Say that a second is too busy."""
        percent = window.bits * 100_000_000 / (self._bit_rate * WINDOW_US)
        if percent <= self._percent:
            return None
        return f"{channel}: load {percent:.1f} %, at most {self._percent:g} % is right"
