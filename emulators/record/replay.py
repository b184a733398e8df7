"""Replay a recorded run on a fresh device and find the first difference."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from typing import Any, Generic

from tickrig.device.core import Device, W
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.text.bench_header import (
    PREFIX,
    BenchHeader,
    DeviceEntry,
    Place,
    WireEntry,
    WireType,
    parse_bench_header,
)
from tickrig.host.text.bench_record import BUS_STATE, BenchParser, BenchRecord
from tickrig.host.text.trace import (
    RESET,
    Header,
    Mark,
    Record,
    TraceError,
    parse_header,
    parse_records,
    trace_text,
)
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

# What a replay is made of: a port that plays, and the comparison of what was said.


@dataclass(frozen=True, slots=True)
class ReplayDifference(Generic[W]):
    """The first tick at which a replay did not say what was recorded.

    Attributes:
        at_us: the tick.
        recorded: what the device said then.
        replayed: what it says now.
        line: the line of the trace, 0 if it said nothing then.
    """

    at_us: int
    recorded: W
    replayed: W
    line: int


class ReplayPort(Generic[W]):
    """Gives a device what it received at the ticks it received it.

    Args:
        received: the traffic with its times.
        nothing: empty traffic.

    Attributes:
        sent: what the device says, with its times.
    """

    def __init__(self, received: Iterable[tuple[int, W]], nothing: W) -> None:
        self._received, self._nothing = deque(received), nothing
        self.sent: list[tuple[int, W]] = []

    @property
    def due_us(self) -> int:
        """When there is something next."""
        return self._received[0][0] if self._received else NEVER

    def poll(self, now_us: int, /) -> W:
        """Take what was received by now."""
        out = self._nothing
        while self._received and self._received[0][0] <= now_us:
            out += self._received.popleft()[1]  # type: ignore[operator]  # bytes or a tuple
        return out

    def send(self, now_us: int, traffic: W, /) -> None:
        """Take what the device says."""
        if traffic:
            self.sent.append((now_us, traffic))


def _first_difference(
    recorded: Sequence[tuple[int, W, int]], replayed: Sequence[tuple[int, W]], nothing: W
) -> ReplayDifference[W] | None:
    """Return the first tick at which something else was said, None if there is none.

    Args:
        recorded: what was said, with its times and lines.
        replayed: what is said now, with its times.
        nothing: empty traffic.
    """
    silence = (NEVER, nothing, 0)
    for then, now in zip_longest(recorded, replayed, fillvalue=silence):
        if then[:2] != now[:2]:
            first_us = min(then[0], now[0])
            _, old, line = then if then[0] == first_us else silence
            return ReplayDifference(first_us, old, now[1] if now[0] == first_us else nothing, line)
    return None


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """A trace as it was read.

    Attributes:
        header: which device, and how it was configured.
        records: the lines in order.
        ended: whether it says how long the run lasted.
            Without that the writer was killed or its disk full, and the last
            tick, which may not be whole, is left out.
    """

    header: Header
    records: tuple[Record, ...]
    ended: bool

    @property
    def until_us(self) -> int:
        """How far the recording reaches."""
        return self.records[-1].at_us if self.records else 0

    @property
    def ticks(self) -> int:
        """How many ticks had traffic or a change."""
        return len({record.at_us for record in self.records if record.mark is not Mark.END})


def read_recording(data: bytes) -> RecordedRun:
    """Read a trace, also one whose writer was killed in the middle of a line.

    Raises:
        TraceError: not a trace of this version, or a line of it is damaged.
    """
    first, *lines = trace_text(data).split("\n")
    header = parse_header(first)
    records = tuple(parse_records(lines[:-1]))
    ended = bool(records) and records[-1].mark is Mark.END
    if not ended:
        records = tuple(r for r in records if r.at_us < records[-1].at_us)
    return RecordedRun(header, records, ended)


def replay(recording: RecordedRun, device: Emulated[bytes]) -> ReplayDifference[bytes] | None:
    """Feed a fresh device what was recorded; None if it said the same.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    records = recording.records
    received = ((r.at_us, r.data) for r in records if r.mark is Mark.TO_DEVICE)
    port = ReplayPort(received, b"")
    rig = Rig(Station(device, port))
    for record in records:
        if record.mark is Mark.PHYSICAL:
            rig.run_to(record.at_us - 1)
            _set_signal(device, record)
    rig.run_to(recording.until_us)
    said = [(r.at_us, r.data, r.line) for r in records if r.mark is Mark.FROM_DEVICE]
    return _first_difference(said, port.sent, b"")


def _set_signal(device: Emulated[bytes], record: Record) -> None:
    if record.text == RESET:
        device.reset()
        return
    try:
        device.inputs.set(*record.change)
    except ValueError as error:
        raise TraceError(f"line {record.line}: {error}") from None


# Replay the recorded run of a bench, device by device.

Traffic = bytes | Frames


@dataclass(frozen=True)
class BenchRecording:
    """A trace as it was read.

    Attributes:
        header: what was on the bench.
        records: the lines in order.
        ended: whether it says how long the run lasted.
            Without that the writer was killed or its disk full, and the last
            tick, which may not be whole, is left out.
    """

    header: BenchHeader
    records: tuple[BenchRecord, ...]
    ended: bool

    @property
    def until_us(self) -> int:
        """How far the recording reaches."""
        return self.records[-1].at_us if self.records else 0

    @property
    def at_port(self) -> bool:
        """Whether its times are those of a host at its port, not of ticks."""
        return self.header.place is Place.PORT

    def ticks_of(self, name: str) -> set[int]:
        """Return the ticks at which a device had traffic or a change."""
        return {record.at_us for record in self.of(name)}

    def of(self, name: str) -> tuple[BenchRecord, ...]:
        """Return the lines of a device."""
        return tuple(x for x in self.records if x.name == name and x.mark is not Mark.WIRE)


def read_bench_recording(data: bytes) -> BenchRecording:
    """Read a trace of either version, also one whose writer was killed in the middle of a line.

    Raises:
        TraceError: not a trace, or a line of it is damaged.
    """
    if not data.startswith(PREFIX.encode()):
        return _as_bench(read_recording(data))
    first, *lines = trace_text(data).split("\n")
    header = parse_bench_header(first)
    records = tuple(BenchParser(header).parse(lines[:-1]))
    ended = bool(records) and records[-1].mark is Mark.END
    if not ended:
        records = tuple(r for r in records if r.at_us < records[-1].at_us)
    return BenchRecording(header, records, ended)


def _as_bench(recording: RecordedRun) -> BenchRecording:
    """Return the recording of one device on a serial line as that of a bench."""
    name, wires = recording.header.device, {"line": WireEntry(WireType.SERIAL)}
    entry = DeviceEntry("line", name, recording.header.config)
    records = tuple(
        BenchRecord(x.at_us, "" if x.mark is Mark.END else name, x.mark, x.data, x.text, x.line)
        for x in recording.records
    )
    return BenchRecording(BenchHeader({name: entry}, wires), records, recording.ended)


def replay_device(
    recording: BenchRecording, name: str, device: Device[Any]
) -> ReplayDifference[Any] | None:
    """Feed a fresh device what one of the bench met; None if it said the same.

    Args:
        recording: the run.
        name: which device of it.
        device: a fresh one.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    nothing: Traffic = () if recording.header.on_can(name) else b""
    said = [*traffic_of(recording.of(name), Mark.FROM_DEVICE)]
    return _first_difference(said, play_device(recording, name, device), nothing)


def play_device(recording: BenchRecording, name: str, device: Device[Any]) -> list[tuple[int, Any]]:
    """Feed a fresh device what one of the bench met; return what it says, with its ticks.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    nothing: Traffic = () if recording.header.on_can(name) else b""
    records = recording.of(name)
    received = ((at, what) for at, what, _ in traffic_of(records, Mark.TO_DEVICE))
    port = ReplayPort[Any](received, nothing)
    rig = Rig(Station(device, port))
    for record in records:
        if record.mark is Mark.PHYSICAL:
            rig.run_to(record.at_us - 1)
            do(device, record)
    rig.run_to(recording.until_us)
    return port.sent


def traffic_of(records: Sequence[BenchRecord], mark: Mark) -> Iterator[tuple[int, Traffic, int]]:
    """Give what passed one way: the time, all of that tick, the first line of it."""
    passed = (record for record in records if record.mark is mark)
    for at_us, group in groupby(passed, key=lambda record: record.at_us):
        first, *more = group
        if isinstance(first.traffic, bytes):
            yield at_us, b"".join(x.traffic for x in (first, *more)), first.line  # type: ignore[misc]  # one device, one type
        else:
            yield at_us, tuple(x.traffic for x in (first, *more)), first.line  # type: ignore[misc]  # as above


def do(device: Any, record: BenchRecord) -> None:
    """Do to a device what was done.

    Raises:
        TraceError: it has no such input, or cannot have that value.
    """
    try:
        if record.text == RESET:
            device.reset()
        elif (change := record.change) is None:
            device.bus_state(BUS_STATE[record.text])
        elif hasattr(device, "signal"):
            signal = device.signal(change[0])
            if signal is None:
                raise ValueError(f"no input {change[0]!r:.60}")
            signal.write(change[1])
        else:
            device.inputs.set(*change)
    except (ValueError, AttributeError) as error:
        raise TraceError(f"line {record.line}: {record.name}: {error}") from None
