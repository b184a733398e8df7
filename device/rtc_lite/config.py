"""What differs from one node to another, and what the paper leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.device.twin import Immutable
from tickrig.wire.rtc_lite.codes import LiteContextType
from tickrig.wire.rtc_lite.frame import Checksum, Framing

RATE_HZ: Final = range(1, 1_001)
"""Rates that a tick of 1 ms can hold."""
DEFAULT_RATE_HZ: Final = 10


@dataclass(frozen=True, slots=True)
class LiteConfig(Immutable):
    """Configuration of an emulated node.

    Attributes:
        framing: frames of RTC-Lite, or packets of RTno (bridge mode).
        checksum: how frames are summed up (DECISION L5); packets of RTno always by `sum8`.
        context: who makes the component execute.
        rate_hz: rate of the timer, 1..1000 Hz, until the proxy sets another.
        slow_answer_us: by how much the fault `slow_answer` delays each answer.

    Raises:
        ValueError: a rate or a delay that a node cannot have.
    """

    framing: Framing = Framing.LITE
    checksum: Checksum = Checksum.SUM8
    context: LiteContextType = LiteContextType.PROXY
    rate_hz: int = DEFAULT_RATE_HZ
    slow_answer_us: int = 200_000

    def __post_init__(self) -> None:
        """Refuse what no node could be."""
        if self.rate_hz not in RATE_HZ:
            raise ValueError(f"rate_hz is {self.rate_hz}, 1..{RATE_HZ[-1]} is possible")
        if self.slow_answer_us < 1:
            raise ValueError(f"slow_answer_us is {self.slow_answer_us}, at least 1 is needed")
        if self.framing is Framing.RTNO and self.checksum is not Checksum.SUM8:
            raise ValueError(f"checksum is {self.checksum}, packets of RTno have sum8")
