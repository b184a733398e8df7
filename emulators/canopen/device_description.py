"""What an EDS or DCF says about a device."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.canopen.dictionary import Dictionary


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


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """A device that slaves can be made of.

    Attributes:
        file: the EDS or DCF.
        info: vendor, product, bit rates.
        template: the objects with default values; never given to a slave.
        node_id: of a DCF, None if it gives none.
        bit_rate: of a DCF in bit/s, None if it gives none.
    """

    file: str
    info: DeviceInfo
    template: Dictionary
    node_id: int | None = None
    bit_rate: int | None = None

    def make_dictionary(self) -> Dictionary:
        """Make the dictionary of one more slave."""
        return self.template.copy()
