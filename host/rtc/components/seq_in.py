"""SeqIn: numbers and sequences of all kinds arrive at InPorts."""

from __future__ import annotations

from typing import ClassVar

from tickrig.host.rtc.component import ModuleSpec, RtComponent
from tickrig.host.rtc.components.seq_ports import SEQ_PORTS
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.execution.states import ReturnCode
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.wire.rtc_types.idl import Struct


class SeqIn(RtComponent):
    """Keeps the latest value of each of its ports, as OpenRTM's shows it.

    Attributes:
        ins: its ports by name.
        latest: the values by the name of their port.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("SeqIn", "Sequence InPort component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.ins = {name: self.add_port(InPort(name, kind)) for name, kind in SEQ_PORTS.items()}
        self.latest: dict[str, Struct] = {}

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Take what arrived."""
        for name, port in self.ins.items():
            while port.is_new and (value := port.read()) is not None:
                self.latest[name] = value
        return ReturnCode.RTC_OK
