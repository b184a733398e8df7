"""What a reader is like. The source names no product; these are choices."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.twin import Immutable


@dataclass(frozen=True, slots=True, kw_only=True)
class ReaderParameters(Immutable):
    """A reader.

    Attributes:
        range_m: how far it hears a marker, 0.1..99.
        cone_deg: whole angle in which it hears, around where it looks, 1..360.

    Raises:
        ValueError: a value that cannot be.
    """

    range_m: float = 3.0
    cone_deg: int = 90

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        if not 0.1 <= self.range_m <= 99:
            raise ValueError(f"range_m {self.range_m} is not in 0.1..99 m")
        if not 1 <= self.cone_deg <= 360:
            raise ValueError(f"cone_deg {self.cone_deg} is not in 1..360 degrees")
