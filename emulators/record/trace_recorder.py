"""Record a bench: what each of its devices receives, sends and suffers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from tickrig.device.core import Device, W
from tickrig.device.twin import Copyable, Immutable
from tickrig.emulators.record.recorder import TracedDevice
from tickrig.host.text.bench_header import BenchHeader
from tickrig.host.text.bench_record import BenchRecord
from tickrig.host.text.line_file import LineFile
from tickrig.host.text.trace import Mark
from tickrig.host.text.whole_file import write_whole


class Tick(NamedTuple):
    """What a device met in a tick, or (mark `~`) a wire between ticks.

    Attributes:
        at_us: the tick.
        name: of the device, or the wire.
        done: what was done to it before, as `stick=5`.
        received: bytes or frames.
        sent: bytes or frames.
        mark: of what was done.
    """

    at_us: int
    name: str
    done: Sequence[str]
    received: Any = b""
    sent: Any = b""
    mark: Mark = Mark.PHYSICAL

    def records(self) -> Iterator[BenchRecord]:
        """Give the lines of it."""
        at_us, name = self.at_us, self.name
        for text in self.done:
            yield BenchRecord(at_us, name, self.mark, text=text)
        for mark, traffic in ((Mark.TO_DEVICE, self.received), (Mark.FROM_DEVICE, self.sent)):
            for item in (traffic,) if isinstance(traffic, bytes) else traffic:
                if item:
                    yield BenchRecord(at_us, name, mark, item)


class TraceRecorder(Copyable):
    r"""Records the devices of a bench, in memory or in a file.

    In memory it keeps all, for `save`; a copy of the bench has what was recorded so far and
    goes on by itself. In a file each tick is written at once, so that a kill loses nothing but
    the last tick; where writing fails the recording ends with one warning, and the run goes on.
    Nobody records a copy then.

    Args:
        path: the file, which is replaced; None to keep the lines in memory.
        header: what is on the bench.

    Raises:
        OSError: the file cannot be opened.

    >>> from tickrig.device.rrc.machine import Rrc
    >>> from tickrig.host.text.bench_header import DeviceEntry, WireEntry, WireType
    >>> wires = {"line": WireEntry(WireType.SERIAL)}
    >>> recorder = TraceRecorder(None, BenchHeader({"rrc": DeviceEntry("line", "rrc")}, wires))
    >>> rrc = recorder.device("rrc", Rrc())
    >>> rrc.tick(10_000, b"")
    b'EV:Initialized\n'
    >>> print(*[*recorder.lines(20_000)][1:], sep=chr(10))
    0.010000 rrc < EV:Initialized\n
    0.020000 .
    """

    def __init__(self, path: Path | None, header: BenchHeader) -> None:
        self.header = header
        self._file = None if path is None else LineFile(path, header.encode())
        self._forgetful = path is not None
        self._shared: tuple[_Ticks, ...] = ()
        self._ticks: list[Tick] = []
        self._last_us = 0

    def device(self, name: str, device: Device[W]) -> TracedDevice[W]:
        """Return a device that is recorded, to be put on a rig instead of the one given.

        Args:
            name: one of the header.
            device: the device, from its first tick on; what it has in `inputs`, and a node's
                objects that are set from the inside, is recorded too.

        Raises:
            KeyError: the header has no such device.
        """
        self.header.devices[name]
        return TracedDevice(device, _Channel(name, self))

    def wire_fault(self, now_us: int, wire: str, text: str) -> None:
        """Note that a fault of a wire began or ended.

        Args:
            now_us: when.
            wire: one of the header.
            text: `cut`, `drop=0.1`; `cut=0` when it has ended.
        """
        self.add(Tick(now_us, wire, (text,), mark=Mark.WIRE))

    @property
    def error(self) -> str:
        """Why the recording ended early, empty while all is well."""
        return self._file.error if self._file else ""

    @property
    def keeps(self) -> bool:
        """Whether it records in memory."""
        return not self._forgetful

    def add(self, tick: Tick) -> None:
        """Record what happened; the run lasts at least as long."""
        self._last_us = max(self._last_us, tick.at_us)
        if not self._forgetful:
            self._ticks.append(tick)
        elif self._file is not None:
            self._file.write([record.encode() for record in tick.records()])

    def lines(self, now_us: int) -> Iterator[str]:
        """Give the lines of what is in memory, as a run that lasted until now.

        Args:
            now_us: time of the rig.
        """
        yield self.header.encode()
        for part in (*(part.ticks for part in self._shared), self._ticks):
            for tick in part:
                yield from (record.encode() for record in tick.records())
        yield BenchRecord(max(now_us, self._last_us), "", Mark.END).encode()

    def save(self, path: Path, now_us: int) -> None:
        """Write what is in memory into a file.

        Args:
            path: the file; one that exists is replaced.
            now_us: time of the rig.

        Raises:
            ValueError: it records in a file already.
            OSError: the file cannot be written.
        """
        if self._forgetful:
            raise ValueError("the run is recorded in a file already")
        write_whole(path, "".join(f"{line}\n" for line in self.lines(now_us)))

    def close(self, now_us: int) -> None:
        """Write into its file how long the run lasted, and close it."""
        if self._file is not None:
            self._file.close(BenchRecord(max(now_us, self._last_us), "", Mark.END).encode())

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a copy; what was recorded so far is shared."""
        if self._ticks:
            self._shared, self._ticks = (*self._shared, _Ticks(tuple(self._ticks))), []
        return {**vars(self), "_file": None}


@dataclass(frozen=True, slots=True)
class _Ticks(Immutable):
    """Ticks that a recorder shares with its copies."""

    ticks: tuple[Tick, ...]


class _Channel(NamedTuple):
    """Where a device is recorded."""

    name: str
    recorder: TraceRecorder

    @property
    def keeps(self) -> bool:
        return self.recorder.keeps

    def hear(self, now_us: int, done: Sequence[str], received: Any, sent: Any) -> None:
        if done or received or sent:
            self.recorder.add(Tick(now_us, self.name, done, received, sent))
