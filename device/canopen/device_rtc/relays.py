"""DeviceRTCs whose out-port says what their in-port heard."""

from __future__ import annotations

from tickrig.device.canopen.device_rtc.component import Component
from tickrig.device.canopen.device_rtc.ports import InPort, OutPort
from tickrig.wire.rtc_canopen.port_types import LONG


class Echo(Component):
    """One in-port, one out-port, both Long."""

    type_name = "Echo"
    vendor = "tickrig"
    category = "example"
    inlet = InPort("in", LONG)
    outlet = OutPort("out", LONG)

    def on_execute(self) -> None:
        """Hand on what is new."""
        if self.inlet.is_new:
            self.outlet.write(self.inlet.read())
