"""What a node on T-Kernel cannot do, in numbers. The report gives none; these are choices."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeLimits:
    """The limits of a node.

    Attributes:
        connectors: how many its ports may have together, 1..1000.
        message_octets: of a value as CDR, 16..1048576.
        tick_us: of its cyclic handlers; periods are multiples of it, 1000..1000000.
        boot_us: from power-up until it answers, 0..600000000.

    Raises:
        ValueError: a limit that cannot be.
    """

    connectors: int = 8
    message_octets: int = 4_096
    tick_us: int = 10_000
    boot_us: int = 3_000_000

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        ranges = {
            "connectors": (1, 1_000),
            "message_octets": (16, 1 << 20),
            "tick_us": (1_000, 1_000_000),
            "boot_us": (0, 600_000_000),
        }
        for name, (low, high) in ranges.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} {getattr(self, name)} is not in {low}..{high}")
