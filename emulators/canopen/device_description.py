"""What an EDS, a DCF or a model says about a device."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.canopen.application import Application
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.nmt_slave import NmtSlave
from tickrig.device.canopen.slave import ServiceMaker


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
        file: the EDS or DCF, or the name of the model.
        info: vendor, product, bit rates.
        template: the objects with default values; never given to a slave.
        node_id: of a DCF or model, None if it gives none.
        bit_rate: of a DCF in bit/s, None if it gives none.
        application: what the device does with its objects.
        nmt: how it follows the NMT master.
    """

    file: str
    info: DeviceInfo
    template: Dictionary
    node_id: int | None = None
    bit_rate: int | None = None
    application: ServiceMaker = Application
    nmt: ServiceMaker = NmtSlave

    def make_dictionary(self) -> Dictionary:
        """Make the dictionary of one more slave."""
        return self.template.copy()
