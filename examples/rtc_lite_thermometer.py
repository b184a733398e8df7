"""A component for a small device, with a sensor and a switch of its own.

`rtc-lite-emu --node examples/rtc_lite_thermometer.py:Thermometer` runs it. It says the
temperature each period, and ends in Error while the sensor is broken.
"""

from __future__ import annotations

from tickrig import InputSignal, SignalType
from tickrig.device.component import ERROR, Result  # internal
from tickrig.device.rtc_lite.component import LiteComponent, LiteInPort, LiteOutPort  # internal
from tickrig.wire.rtc_lite.values import BOOLEAN, FLOAT  # internal


class Thermometer(LiteComponent):
    """One sensor; an in-port sets the limit above which it is hot."""

    type_name = "Thermometer"
    physical = (
        InputSignal("temperature_dc", "at the sensor", low=-400, high=1_250, unit="0.1 degC"),
        InputSignal("sensor_broken", "the cable of the sensor is cut", SignalType.FAULT),
    )
    limit = LiteInPort("limit", FLOAT)
    celsius = LiteOutPort("celsius", FLOAT)
    hot = LiteOutPort("hot", BOOLEAN)

    def on_execute(self) -> Result:
        """Measure."""
        if self.inputs["sensor_broken"]:
            return ERROR
        celsius = self.inputs["temperature_dc"] / 10
        self.celsius.write(celsius)
        self.hot.write(celsius > self.limit.value)
        return None

    def on_reset(self) -> Result:
        """Stay in Error until the sensor is repaired."""
        return ERROR if self.inputs["sensor_broken"] else None
