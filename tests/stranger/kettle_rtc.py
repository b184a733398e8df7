"""An RT component of somebody else: what a kettle says, in degrees Fahrenheit."""

from __future__ import annotations

from typing import ClassVar

from tickrig.rtc import (
    ExecutionContext,
    InPort,
    ModuleSpec,
    OutPort,
    ReturnCode,
    RtComponent,
    TimedDouble,
)


class Fahrenheit(RtComponent):
    """Converts each temperature that arrives, degC to degF."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Fahrenheit", "degC to degF", vendor="stranger")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.celsius = self.add_port(InPort("celsius", TimedDouble))
        self.fahrenheit = self.add_port(OutPort("fahrenheit", TimedDouble))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Convert what arrived."""
        while self.celsius.is_new and (value := self.celsius.read()) is not None:
            self.fahrenheit.write(TimedDouble(value.tm, value.data * 1.8 + 32))
        return ReturnCode.RTC_OK
