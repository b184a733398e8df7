"""ConsoleIn: what is typed goes to an OutPort."""

from __future__ import annotations

from collections import deque
from typing import ClassVar

from tickrig.host.rtc.component import ModuleSpec, RtComponent
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.execution.states import ReturnCode
from tickrig.host.rtc.ports.data_port import OutPort
from tickrig.wire.rtc_types.basic import Time, TimedLong


class ConsoleIn(RtComponent):
    """Writes one number that was entered in each period.

    OpenRTM's asks for a number and waits; here nothing waits, and `enter` is
    called by whoever has the console.

    Attributes:
        waiting: what was entered and not yet written.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ConsoleIn", "Console input component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.out = self.add_port(OutPort("out", TimedLong))
        self.waiting: deque[int] = deque()

    def enter(self, *numbers: int) -> None:
        """Enter numbers, -2**31..2**31-1."""
        self.waiting.extend(numbers)

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the oldest number that was entered."""
        if self.waiting:
            self.out.write(TimedLong(Time.from_us(ec.now_us), self.waiting.popleft()))
        return ReturnCode.RTC_OK
