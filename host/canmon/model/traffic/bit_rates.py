"""The bit rates of a bus, and how long a CAN FD frame is at both of them.

>>> frame = FdFrame.parse("123##1AABB")
>>> BitRates(500_000, 2_000_000).bits(frame), BitRates().bits(frame)
(42, 78)
"""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.wire.can_fd import FdFrame, fd_bits


class BitRates(NamedTuple):
    """Bit rates in bit/s; None where nobody told.

    Attributes:
        nominal: of arbitration, and of all of a classic frame.
        fast: of the data of CAN FD frames with BRS.
    """

    nominal: int | None = None
    fast: int | None = None

    def tells(self, frame: FdFrame) -> bool:
        """Say whether the rates of all parts of a frame are known."""
        return not frame.brs or bool(self.nominal and self.fast)

    def bits(self, frame: FdFrame) -> int:
        """Return how long a frame takes, in bits of the nominal rate, rounded up.

        Fast bits count as nominal ones where a rate is not known: then it takes less.
        """
        nominal, fast = fd_bits(frame)
        if self.nominal and self.fast:
            return nominal - (-fast * self.nominal // self.fast)
        return nominal + fast


NO_RATES: Final = BitRates()
