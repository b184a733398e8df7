"""What an EDS, a DCF or a model says about a device."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.slave import ServiceMaker
from tickrig.wire.canopen.eds.device_info import DeviceInfo
from tickrig.wire.canopen.eds.eds_finding import Finding


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
        warnings: what is not by the standard in its file.
    """

    file: str
    info: DeviceInfo
    template: Dictionary
    node_id: int | None = None
    bit_rate: int | None = None
    application: ServiceMaker = Application
    warnings: tuple[Finding, ...] = ()

    def make_dictionary(self) -> Dictionary:
        """Make the dictionary of one more slave."""
        return self.template.copy()
