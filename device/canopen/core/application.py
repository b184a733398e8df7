"""What a device does with its objects, at its place in the tick."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank
from tickrig.wire.instant import NEVER


@mypyc_attr(allow_interpreted_subclasses=True)
class Application(Service):
    """Works on the objects after the RPDOs and SDOs of a tick, before its TPDOs.

    By itself it does nothing. A device profile overrides `on_execute`, which is
    called in the ticks that it asks for: by `request`, by `schedule`, when one
    of its watched objects has changed, and when a physical input was set. It
    reacts to NMT states (`state_changed`), to resets (`start`), to lost masters
    (`communication_error`) and, if it enters itself in `node.sync_handlers`, of each
    SYNC; it reports errors by `node.emergency`.

    Attributes:
        inputs: what the world does to the device: `has_inputs` makes them.
        outputs: what the world sees of it; `read` gives the values.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.inputs = QuantityBank()
        self.outputs: Mapping[str, OutputSignal] = {}

    def has_inputs(
        self, table: Iterable[InputSignal], groups: Mapping[str, tuple[str, ...]] | None = None
    ) -> None:
        """Give it physical inputs; setting one asks for `on_execute`.

        Args:
            table: the inputs.
            groups: names of several inputs that are set together.
        """
        self.inputs = QuantityBank(table, groups, self.request)

    def read(self, name: str) -> int | float | str:
        """Look at a physical output.

        Args:
            name: one of `outputs`.

        Returns:
            Its present value.

        Raises:
            KeyError: there is none of that name.
        """
        raise KeyError(name)

    def on_execute(self, now_us: int) -> None:
        """Read inputs, work, write outputs; a device profile overrides it.

        Args:
            now_us: time of the tick.
        """

    def without_power(self, now_us: int) -> int:
        """Let time pass while the supply is cut: what moves coasts.

        Called in the first tick without power, and when a physical input was set.

        Args:
            now_us: time of the tick.

        Returns:
            When it wants to be called again, `NEVER` if nothing will change by itself.
        """
        return NEVER

    def request(self) -> None:
        """Ask for `on_execute` in this tick; between two ticks, in the next one."""
        self.schedule(self.node.now_us)

    def watch(self, entries: Iterable[Entry]) -> None:
        """Call `on_execute` whenever one of some objects has changed.

        Args:
            entries: the objects.
        """
        changed = self._object_changed
        for entry in entries:
            entry.watch(changed)

    def _object_changed(self, entry: Entry) -> None:
        self.request()

    def tick(self, now_us: int) -> None:
        """Execute; `on_execute` says what."""
        self.on_execute(now_us)


def number_of(entry: Entry | None, default: int) -> int:
    """Return the number in an object, the default if the device has no such object."""
    return default if entry is None else entry.number
