"""What a schedule ticks beside execution contexts and connectors."""

from __future__ import annotations

from tests.host.rtc.spy import Spy
from tickrig.host.rtc import Manager
from tickrig.wire.instant import NEVER


class ScheduledItem:
    """Notes when it was ticked; due each 300 us."""

    def __init__(self, manager: Manager, calls: list[str]) -> None:
        self._manager, self._calls, self.due_us = manager, calls, 300
        self.ticks_us: list[int] = []

    def tick(self, now_us: int, /) -> None:
        self.ticks_us.append(now_us)
        self._calls.append("item")
        self.due_us += 300
        if now_us >= 900:
            self._manager.remove_item(self)


def test_an_item_is_ticked_when_it_is_due_until_it_is_dropped() -> None:
    manager = Manager()
    item = ScheduledItem(manager, [])
    manager.add_item(item)
    assert manager.due_us == 300
    manager.run_for(5_000)
    assert item.ticks_us == [300, 600, 900]
    assert manager.due_us == NEVER


def test_items_go_before_execution_contexts() -> None:
    manager, calls = Manager(), list[str]()
    spy = manager.add(Spy("Spy0", calls), rate_hz=1_000.0)
    manager.activate(spy.instance_name)
    manager.add_item(ScheduledItem(manager, calls))
    calls.clear()
    manager.tick(1_000)
    assert calls[0] == "item"
    assert "Spy0.on_execute" in calls
