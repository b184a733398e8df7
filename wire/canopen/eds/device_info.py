"""What the head of an EDS says about a device (CiA 306)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

BIT_RATES_KBIT: Final = (10, 20, 50, 125, 250, 500, 800, 1000)
BIT_RATES: Final = frozenset(1_000 * kbit for kbit in BIT_RATES_KBIT)
"""All of them, in bit/s."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Who made it, and what it can do.

    Attributes:
        vendor_name: empty if unknown.
        product_name: empty if unknown.
        order_code: empty if unknown.
        bit_rates: bit/s that it supports.
    """

    vendor_name: str = ""
    product_name: str = ""
    order_code: str = ""
    bit_rates: frozenset[int] = frozenset()
