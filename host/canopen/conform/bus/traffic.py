"""How much of the bus the tester may use, and how much others use."""

from __future__ import annotations

from typing import Final

from tickrig.wire.can import CanFrame
from tickrig.wire.can_bits import frame_bits

ASSUMED_BIT_RATE: Final = 125_000
"""In bit/s, where nobody says it: slow, so that the limit holds on any faster bus."""

WINDOW_US: Final = 100_000
"""The load is limited over so long."""

LONGEST_WAIT_US: Final = 1_000_000
"""A node that floods the bus with answers does not keep the tester from sending."""

PLENTY_BIT_S: Final = 12_500
"""With less for the tester, in bit/s, all takes longer: so may a check."""

FOREIGN_LOAD: Final = 0.5
"""With more of it by other nodes, a late or missing answer says nothing of the node."""


class Allowance:
    """What may be sent: a bucket that fills with the allowed share of the bit rate.

    Args:
        bit_rate: of the bus in bit/s.
        max_load: share of it, above 0 to 1.

    Attributes:
        slowness: so many times as long as usual may all take.
    """

    def __init__(self, bit_rate: int, max_load: float) -> None:
        self._bits_us = bit_rate * max_load / 1e6
        self._most = self._left = self._bits_us * WINDOW_US
        self._at_us = 0
        self.slowness = max(1.0, PLENTY_BIT_S / (bit_rate * max_load))

    def use(self, now_us: int, frame: CanFrame) -> None:
        """Count a frame of the tester, or an answer to one."""
        self._fill(now_us)
        self._left -= frame_bits(frame)

    def wait_us(self, now_us: int) -> int:
        """Return how long nothing may be sent, at most `LONGEST_WAIT_US`."""
        self._fill(now_us)
        if self._left >= 0:
            return 0
        return min(LONGEST_WAIT_US, int(-self._left / self._bits_us) + 1)

    def _fill(self, now_us: int) -> None:
        if now_us > self._at_us:
            self._left = min(self._most, self._left + (now_us - self._at_us) * self._bits_us)
            self._at_us = now_us


class ForeignLoad:
    """The load by other nodes, in windows of `WINDOW_US`.

    Args:
        bit_rate: of the bus in bit/s.
    """

    def __init__(self, bit_rate: int) -> None:
        self._most_bits = bit_rate * WINDOW_US * FOREIGN_LOAD / 1e6
        self._window = self._bits = 0

    def add(self, at_us: int, frame: CanFrame) -> bool:
        """Count a frame; True if the bus is loaded too much to judge."""
        window = at_us // WINDOW_US
        if window != self._window:
            self._window, self._bits = window, 0
        self._bits += frame_bits(frame)
        return self._bits > self._most_bits
