"""What a device does with its objects, at its place in the tick."""

from __future__ import annotations

from collections.abc import Iterable

from tickrig.device.canopen.entry import Entry
from tickrig.device.canopen.service import Service


class Application(Service):
    """Works on the objects after the RPDOs and SDOs of a tick, before its TPDOs.

    By itself it does nothing. A device profile overrides `on_execute`, which is
    called in the ticks that it asks for: by `request`, by `schedule`, and when one
    of its `inputs` has changed. It hears of NMT states (`state_changed`), of resets
    (`start`), of lost masters (`communication_error`) and, if it enters itself in
    `node.on_sync`, of each SYNC; it tells errors by `node.emergency`.
    """

    def on_execute(self, now_us: int) -> None:
        """Read inputs, work, write outputs."""

    def request(self) -> None:
        """Ask for `on_execute` in this tick; between two ticks, in the next one."""
        self.schedule(self.node.now_us)

    def watch(self, entries: Iterable[Entry]) -> None:
        """Call `on_execute` whenever one of these objects has changed."""
        for entry in entries:
            entry.watchers.append(self.request)

    def tick(self, now_us: int) -> None:
        """Execute."""
        self.on_execute(now_us)


def number_of(entry: Entry | None, default: int) -> int:
    """Return the number in an object, the default if the device has no such object."""
    return default if entry is None else entry.number
