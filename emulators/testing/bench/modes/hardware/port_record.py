"""What passed the ports of real devices, and what was done to them, as a trace."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import RigPlan
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, Place, WireEntry, WireType
from tickrig.host.text.bench_record import BenchRecord, change_text
from tickrig.host.text.trace import RESET, Mark
from tickrig.host.text.values import Setting
from tickrig.host.text.whole_file import write_whole


class PortRecord:
    """Keeps all of it, for `tickrig compare`; hosts have threads, which take turns.

    In the trace a serial line is called as its first device, a CAN bus by its own name. What was
    done to nodes is not in it: a bus is compared by its frames.

    Args:
        plan: the rig file.
        mounts: such wires, which know what they are.
        now_us: the time.
    """

    def __init__(
        self, plan: RigPlan, mounts: Mapping[str, Mount], now_us: Callable[[], int]
    ) -> None:
        self._now_us, self._records = now_us, list[BenchRecord]()
        self._names = {
            wire: next(iter(mount.devices)) if isinstance(mount, LineMount) else wire
            for wire, mount in mounts.items()
        }
        self._header = BenchHeader(
            {
                name: DeviceEntry(wire, plan.devices[name].type if name in plan.devices else "")
                for wire, name in self._names.items()
            },
            {wire: _wire_entry(mount) for wire, mount in mounts.items()},
            place=Place.PORT,
        )

    def passed(self, wire: str, mark: Mark, traffic: Any) -> None:
        """Keep bytes or frames."""
        items = [traffic] if isinstance(traffic, bytes) else traffic
        self._records += [
            BenchRecord(self._now_us(), self._names[wire], mark, item) for item in items if item
        ]

    def changed(self, device: str, name: str, value: Setting, after_us: int = 0) -> None:
        """Keep that an input was set, or will be after a time."""
        self._done(device, change_text(name, value), after_us)

    def was_reset(self, device: str) -> None:
        """Keep that a device was switched on."""
        self._done(device, RESET)

    def save(self, path: Path) -> None:
        """Write the trace; OSError if it cannot be."""
        now_us = self._now_us()
        records = sorted((x for x in self._records if x.at_us <= now_us), key=lambda x: x.at_us)
        end = BenchRecord(now_us, "", Mark.END)
        lines = [self._header.encode(), *(each.encode() for each in (*records, end))]
        write_whole(path, "".join(f"{line}\n" for line in lines))

    def _done(self, device: str, text: str, after_us: int = 0) -> None:
        if device in self._names.values():
            at_us = self._now_us() + after_us
            self._records.append(BenchRecord(at_us, device, Mark.PHYSICAL, text=text))


def _wire_entry(mount: Mount) -> WireEntry:
    if isinstance(mount, LineMount):
        return WireEntry(WireType.SERIAL)
    return WireEntry(WireType.CAN, {"bit_rate": mount.wire.bit_rate})
