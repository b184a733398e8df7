"""Systems for tests."""

from __future__ import annotations

from tickrig.host.rtc import Manager
from tickrig.host.rtc.components import EXAMPLES, ConsoleIn, ConsoleOut

PERIOD_US = 1_000


def make_manager() -> Manager:
    """Return a manager that knows the example components."""
    manager = Manager()
    for kind in EXAMPLES:
        manager.register(kind)
    return manager


class Chain:
    """ConsoleIn to ConsoleOut, both Active, joined with given properties."""

    def __init__(self, **properties: str) -> None:
        self.manager = make_manager()
        self.source = self.manager.add(ConsoleIn("ConsoleIn0"))
        self.sink = self.manager.add(ConsoleOut("ConsoleOut0"))
        self.properties = {f"dataport.{key}": text for key, text in properties.items()}
        self.manager.connect("ConsoleIn0.out", "ConsoleOut0.in", self.properties)
        self.manager.activate("ConsoleIn0", "ConsoleOut0")

    @property
    def numbers(self) -> list[int]:
        """What arrived."""
        return [value.data for value in self.sink.received]
