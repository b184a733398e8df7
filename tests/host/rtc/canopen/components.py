"""Components at the other end of connectors."""

from __future__ import annotations

from typing import Any

from tickrig.host.rtc import (
    ExecutionContext,
    InPort,
    Manager,
    ModuleSpec,
    OutPort,
    ReturnCode,
    RtComponent,
)
from tickrig.wire.rtc_types.idl import Struct


class Logger(RtComponent):
    """Keeps what comes to its port `in`, and when."""

    spec = ModuleSpec("Logger")

    def __init__(self, instance_name: str, kind: type[Struct]) -> None:
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort[Any]("in", kind))
        self.heard: list[tuple[int, Any]] = []

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        while self.in_.is_new:
            self.heard.append((ec.now_us, self.in_.read()))
        return ReturnCode.RTC_OK


class Knob(RtComponent):
    """Writes what it is told to its port `out`."""

    spec = ModuleSpec("Knob")

    def __init__(self, instance_name: str, kind: type[Struct]) -> None:
        super().__init__(instance_name)
        self.out = self.add_port(OutPort[Any]("out", kind))


def add_logger(manager: Manager, kind: type[Struct], name: str = "Logger0") -> Logger:
    logger = manager.add(Logger(name, kind), rate_hz=1_000.0)
    manager.activate(name)
    return logger


def add_knob(manager: Manager, kind: type[Struct], name: str = "Knob0") -> Knob:
    return manager.add(Knob(name, kind), rate_hz=1_000.0)
