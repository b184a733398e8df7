"""Traffic of the connections to real devices, and actions on them, for a journal."""

from __future__ import annotations

import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from weakref import WeakSet

from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench_rig import Journal
from tickrig.emulators.testing.bench.modes.door_watch import HostPace, Seen
from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import RigPlan
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, Place, WireEntry, WireType
from tickrig.host.text.bench_record import BenchRecord, change_text
from tickrig.host.text.trace import RESET, Mark
from tickrig.host.text.values import Setting
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.can import CanFrame, Frames

# Traffic and actions of real devices, as a trace.


class PortRecord:
    """Records the traffic of real devices and the operator's actions, for `tickrig compare`.

    Several host threads may use it at once. In the trace a serial line has the name of its first
    device, and a CAN bus has its own name. Actions on CANopen nodes are not in the trace: on a CAN
    bus, only the frames are compared.

    Args:
        plan: content of the rig file.
        mounts: emulated wires with the same devices and settings as the real wires, by name of the
            wire. The header of the trace is made from these emulated wires.
        now_us: function that returns the time in microseconds.
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
        """Record a set input, now or after a time."""
        self._done(device, change_text(name, value), after_us)

    def was_reset(self, device: str) -> None:
        """Record that a device was switched on."""
        self._done(device, RESET)

    def save(self, path: Path) -> None:
        """Write the trace; raise OSError if that fails."""
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
    """Journal of a bench in real time, whose hosts send and receive in several threads.

    Args:
        now_us: function that returns the time in microseconds.
        after: function that is called after traffic was received.
        record: recording that gets the same data.
    """

    def __init__(
        self, now_us: Callable[[], int], after: Callable[[], None], record: PortRecord
    ) -> None:
        super().__init__()
        self.record = record
        self._now_us, self._after, self._lock = now_us, after, threading.Lock()
        self._watches: defaultdict[str, WeakSet[_BusWatch]] = defaultdict(WeakSet)

    def watch(self, mount: Mount, pace: HostPace) -> HostPace:
        """Return a monitor that adds the traffic of a host's connection to the journal.

        Args:
            mount: name and settings of the wire to which the host is connected.
            pace: monitor that measures how late the host is.
        """
        if isinstance(mount, LineMount):
            return _Watch(pace, partial(self._hear_bytes, mount.name, self._splitting(mount)))
        watch = _BusWatch(pace, mount.name, self)
        self._watches[mount.name].add(watch)
        return watch

    def note(self, device: str, text: str, **changes: Setting) -> None:
        """Add an action of the operator to the journal.

        Args:
            device: name of the device.
            text: description of the action.
            changes: inputs of the device that the action has changed, with their new values.
        """
        with self._lock:
            for name, value in changes.items():
                self.record.changed(device, name, value)
            self.add(self._now_us(), Mark.PHYSICAL, text.encode(), device)

    def lines(self) -> tuple[WireLine, ...]:
        """Return the kept lines; a frame that ended with a silence is included."""
        self.look()
        return super().lines()

    def look(self) -> None:
        """Add frames that a silence has ended; with real devices no rig adds them."""
        with self._lock:
            self.end_silent(self._now_us())

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
        """Add CAN frames of a host's connection to the journal.

        A frame is left out if another connection of the same bus has already recorded it. Error
        frames are added to the journal, but not to the trace for `tickrig compare`.
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
        """Mark frames as already recorded, so that no other connection records them again.

        Args:
            wire: name of the bus.
            watch: monitor of the connection that records the frames.
            frames: the recorded frames.
            by: the value 1 marks the frames. The value -1 undoes this, if the frames could not be
                sent.
        """
        with self._lock:
            self._announce(wire, watch, frames, by)

    def _announce(self, wire: str, watch: _BusWatch, frames: Seen, by: int = 1) -> None:
        for other in self._watches[wire]:
            if other is not watch:
                for frame in frames:
                    other.known[str(frame)] += by


class _Watch(HostPace):
    """Monitor that forwards the traffic of hosts."""

    def __init__(self, pace: HostPace, hear: Callable[[Mark, Any], None]) -> None:
        super().__init__()
        self._pace, self._hear = pace, hear

    def waited(self, wanted_us: int, took_us: int) -> None:
        self._pace.waited(wanted_us, took_us)

    def passed(self, mark: Mark, traffic: Any) -> None:
        self._hear(mark, traffic)


class _BusWatch(_Watch):
    """Monitor of one of several connections of a bus; each connection sees each frame.

    Attributes:
        known: frames that are already in the journal, but that this connection has not received
            yet.
    """

    def __init__(self, pace: HostPace, wire: str, journal: DoorJournal) -> None:
        super().__init__(pace, partial(journal.hear_frames, wire, self))
        self._wire, self._journal = wire, journal
        self.known: Counter[str] = Counter()

    @contextmanager
    def sending(self, frames: Frames) -> Iterator[None]:
        """Mark frames as recorded at the other connections, before these can receive the frames."""
        self._journal.announce(self._wire, self, frames)
        try:
            yield
        except BaseException:
            self._journal.announce(self._wire, self, frames, by=-1)
            raise
