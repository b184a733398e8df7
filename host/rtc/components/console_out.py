"""ConsoleOut: what arrives at an InPort is shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from tickrig.host.rtc.component import ModuleSpec, RtComponent
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.execution.states import ReturnCode
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.wire.rtc_types.basic import TimedLong


class ConsoleOut(RtComponent):
    """Shows each number that arrives.

    Attributes:
        received: all that arrived, in order.
        show: told each value; whoever has the console prints it.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ConsoleOut", "Console output component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.received: list[TimedLong] = []
        self.show: Callable[[TimedLong], None] | None = None

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Show what arrived."""
        while self.in_.is_new and (value := self.in_.read()) is not None:
            self.received.append(value)
            if self.show is not None:
                self.show(value)
        return ReturnCode.RTC_OK
