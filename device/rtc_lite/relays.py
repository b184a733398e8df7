"""Components whose out-port says what their in-port heard: an echo, and those of the paper."""

from __future__ import annotations

from tickrig.device.rtc_lite.component import Component
from tickrig.device.rtc_lite.ports import InPort, OutPort
from tickrig.wire.rtc_lite.values import LONG


class Echo(Component):
    """One in-port, one out-port, both TimedLong."""

    type_name = "Echo0"
    inlet = InPort("in", LONG)
    outlet = OutPort("out", LONG)

    def on_execute(self) -> None:
        """Hand on what is new."""
        if self.inlet.is_new:
            self.outlet.write(self.inlet.read())


class LiteA(Echo):
    """The first RTC-Lite component of the paper's experiments (DECISION L16)."""

    type_name = "LiteA"


class LiteB(Echo):
    """The second one."""

    type_name = "LiteB"
