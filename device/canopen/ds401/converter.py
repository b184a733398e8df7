"""What an analogue channel is in the physical world: range, unit and steps."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

from tickrig.device.twin import Immutable


@dataclass(frozen=True, slots=True)
class Converter(Immutable):
    """A linear converter between a physical quantity and the counts of an object.

    >>> adc = Converter("v", "V", low=0.0, high=5.0, high_raw=4095, shift=3)
    >>> adc.counts(1.25), adc.quantity(8192)
    (8192, 1.2503052503052503)

    Not emulated: offset and gain errors, noise, the conversion time.

    Attributes:
        suffix: ends the name of a channel: `ai1_v`.
        unit: for people.
        low: smallest quantity.
        high: largest quantity.
        high_raw: steps at `high`.
        low_raw: steps at `low`.
        shift: places by which a step stands left in the object, as CiA 401 wants it.
        width: bits of the object that the counts are meant for.

    Raises:
        ValueError: an empty range, or counts that the object cannot hold.
    """

    suffix: str
    unit: str
    low: float
    high: float
    high_raw: int
    low_raw: int = 0
    shift: int = 0
    width: int = 16

    def __post_init__(self) -> None:
        if not self.low < self.high or not self.low_raw < self.high_raw:
            raise ValueError(f"converter: {self.low}..{self.high} {self.unit} is no range")
        limit = 1 << self.width - 1
        if not -limit <= self.low_raw << self.shift <= self.high_raw << self.shift < limit:
            raise ValueError(f"converter: counts do not fit into {self.width} bit")

    @property
    def span(self) -> tuple[int, int, int]:
        """What the object holds for `low` and for `high`, and a step between."""
        return self.low_raw << self.shift, self.high_raw << self.shift, 1 << self.shift

    def counts(self, quantity: float) -> int:
        """Return what the object holds for a quantity, which is limited to the range."""
        part = (min(max(quantity, self.low), self.high) - self.low) / (self.high - self.low)
        return floor(self.low_raw + part * (self.high_raw - self.low_raw) + 0.5) << self.shift

    def quantity(self, counts: int) -> float:
        """Return the quantity of these counts, limited to the range."""
        part = ((counts >> self.shift) - self.low_raw) / (self.high_raw - self.low_raw)
        return self.low + min(max(part, 0.0), 1.0) * (self.high - self.low)
