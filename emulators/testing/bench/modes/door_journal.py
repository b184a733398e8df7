"""What passes the doors to real devices, and what is done to them, for a journal."""

from __future__ import annotations

import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from weakref import WeakSet

from tickrig.emulators.testing.bench.bench_rig import Journal
from tickrig.emulators.testing.bench.modes.door_watch import DoorWatch, HostPace, Seen
from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import RigPlan
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, Place, WireEntry, WireType
from tickrig.host.text.bench_record import BenchRecord, change_text
from tickrig.host.text.trace import RESET, Mark
from tickrig.host.text.values import Setting
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.can import CanFrame, Frames

# What passed the ports of real devices, and what was done to them, as a trace.


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


class DoorJournal(Journal):
    """A journal of what hosts send and receive; hosts have threads.

    Args:
        now_us: the time.
        after: called when something has been heard.
        record: gets the same, for a trace.
    """

    def __init__(
        self, now_us: Callable[[], int], after: Callable[[], None], record: PortRecord
    ) -> None:
        super().__init__()
        self.record = record
        self._now_us, self._after, self._lock = now_us, after, threading.Lock()
        self._watches: defaultdict[str, WeakSet[_BusWatch]] = defaultdict(WeakSet)

    def watch(self, mount: Mount, pace: HostPace) -> DoorWatch:
        """Return a watch at a door of a wire.

        Args:
            mount: such a wire.
            pace: learns how late the host is.
        """
        if isinstance(mount, LineMount):
            return _Watch(pace, partial(self._hear_bytes, mount.name, self._splitting(mount)))
        watch = _BusWatch(pace, mount.name, self)
        self._watches[mount.name].add(watch)
        return watch

    def note(self, device: str, text: str, **changes: Setting) -> None:
        """Note what was done to a device, and what its inputs are now."""
        with self._lock:
            for name, value in changes.items():
                self.record.changed(device, name, value)
            self.add(self._now_us(), Mark.PHYSICAL, text.encode(), device)

    def _splitting(self, mount: LineMount) -> Callable[[int, Mark, bytes], None]:
        return self.of_line(mount.name, mount.settings.splitter)

    def _hear_bytes(
        self, wire: str, hear: Callable[[int, Mark, bytes], None], mark: Mark, data: bytes
    ) -> None:
        with self._lock:
            self.record.passed(wire, mark, data)
            hear(self._now_us(), mark, data)
        self._after()

    def hear_frames(self, wire: str, watch: _BusWatch, mark: Mark, frames: Seen) -> None:
        """Note frames that passed a door, unless another one of its bus has told of them.

        The trace has no error frames.
        """
        with self._lock:
            self.record.passed(wire, mark, [each for each in frames if isinstance(each, CanFrame)])
            for frame in frames:
                if mark is Mark.FROM_DEVICE:
                    if watch.known[str(frame)] > 0:
                        watch.known[str(frame)] -= 1
                        continue
                    self._announce(wire, watch, (frame,))
                self.add(self._now_us(), mark, str(frame).encode(), wire)
        self._after()

    def announce(self, wire: str, watch: _BusWatch, frames: Seen, by: int = 1) -> None:
        """Let all doors of a bus but one know frames, or forget them again."""
        with self._lock:
            self._announce(wire, watch, frames, by)

    def _announce(self, wire: str, watch: _BusWatch, frames: Seen, by: int = 1) -> None:
        for other in self._watches[wire]:
            if other is not watch:
                for frame in frames:
                    other.known[str(frame)] += by


class _Watch:
    """Lets hosts pass, and hands on what they carry."""

    def __init__(self, pace: HostPace, hear: Callable[[Mark, Any], None]) -> None:
        self.waited, self.passed, self.sending = pace.waited, hear, pace.sending

    def used(self) -> None:
        """Anybody may, at any time."""


class _BusWatch:
    """A watch at one of several doors of a bus, each of which sees each frame.

    Attributes:
        known: frames that are in the journal already, and have yet to be seen here.
    """

    def __init__(self, pace: HostPace, wire: str, journal: DoorJournal) -> None:
        self.waited, self._wire, self._journal = pace.waited, wire, journal
        self.known: Counter[str] = Counter()

    def used(self) -> None:
        """Anybody may, at any time."""

    def passed(self, mark: Mark, frames: Seen) -> None:
        self._journal.hear_frames(self._wire, self, mark, frames)

    @contextmanager
    def sending(self, frames: Frames) -> Iterator[None]:
        """Let the other doors know of frames before they can see them."""
        self._journal.announce(self._wire, self, frames)
        try:
            yield
        except BaseException:
            self._journal.announce(self._wire, self, frames, by=-1)
            raise
