"""Replay a recorded run on a fresh device and find the first difference."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic

from tickrig.device.core import Device, W
from tickrig.device.horizon import Horizon
from tickrig.emulators.rig.emulated import Emulated
from tickrig.host.text import bench_header, notebook, trace
from tickrig.host.text.bench_record import BUS_STATE, BenchParser, BenchRecord
from tickrig.host.text.values import format_time
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER, next_tick_us

if TYPE_CHECKING:
    import pandas

# What a replay is made of: the run of one device, and the comparison of what was said.


@dataclass(frozen=True, slots=True)
class ReplayDifference(Generic[W]):
    """The first tick of a replay in which the device's output differs from the recording.

    Attributes:
        at_us: time of the tick in microseconds.
        recorded: output of the device in the recording.
        replayed: output of the device in the replay.
        line: line number in the trace, or 0 if the recording has no output in this tick.
    """

    at_us: int
    recorded: W
    replayed: W
    line: int


@dataclass(frozen=True, slots=True)
class _Change:
    """An action on a device before a tick."""

    at_us: int
    act: Callable[[], None]


def _play(
    device: Device[W],
    received: Iterable[tuple[int, W, int]],
    changes: Iterable[_Change],
    nothing: W,
    until_us: int,
) -> list[tuple[int, W]]:
    """Repeat traffic and changes on a device; return its output with the ticks.

    The function behaves like a `Rig` with the device as its only station: only ticks with work are
    run. No code reads the device between two changes, so a drive may compute ahead (`Horizon`).

    Args:
        device: a new device.
        received: the traffic with its times and lines, sorted.
        changes: the actions on it, sorted.
        nothing: empty traffic.
        until_us: time of the last tick.
    """
    sent: list[tuple[int, W]] = []
    horizon, tick_us, now_us = Horizon(), device.tick_us, 0
    if hasattr(device, "horizon"):
        device.horizon = horizon
    traffic, end = iter(received), (NEVER, nothing, 0)
    next_us, arriving, _ = next(traffic, end)
    for change in (*changes, _Change(until_us + 1, _nothing)):
        horizon.until_us = last_us = change.at_us - 1
        while True:
            due_us = device.due_us
            at_us = next_tick_us(now_us, min(due_us, next_us), tick_us)
            if at_us > last_us:
                break
            rx = nothing
            while next_us <= at_us:
                rx += arriving  # type: ignore[operator]  # bytes or a tuple
                next_us, arriving, _ = next(traffic, end)
            if (rx or due_us <= at_us) and (tx := device.tick(at_us, rx)):
                sent.append((at_us, tx))
            horizon.passed_us = now_us = at_us
        horizon.passed_us = now_us = max(now_us, last_us)
        horizon.until_us = 0
        change.act()
    return sent


def _nothing() -> None:
    """Do nothing."""


def _first_difference(
    recorded: Sequence[tuple[int, W, int]], replayed: Sequence[tuple[int, W]], nothing: W
) -> ReplayDifference[W] | None:
    """Return the first tick with different output, or None if there is none.

    Args:
        recorded: recorded output, with times and lines.
        replayed: output of the replay, with times.
        nothing: empty traffic.
    """
    silence = (NEVER, nothing, 0)
    for then, now in zip_longest(recorded, replayed, fillvalue=silence):
        if then[0] != now[0] or then[1] != now[1]:
            first_us = min(then[0], now[0])
            _, old, line = then if then[0] == first_us else silence
            return ReplayDifference(first_us, old, now[1] if now[0] == first_us else nothing, line)
    return None


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """Content of a trace with a single device, as `read_recording` returns it.

    Attributes:
        header: header with the device and its configuration.
        records: lines of the trace in order.
        ended: whether the trace has its end line. If not, the writer was killed or its disk was
            full. The last tick may then be incomplete and is left out of `records`.
    """

    header: trace.Header
    records: tuple[trace.Record, ...]
    ended: bool

    @property
    def until_us(self) -> int:
        """Duration of the recording."""
        return self.records[-1].at_us if self.records else 0

    @property
    def ticks(self) -> int:
        """Number of ticks with traffic or a change."""
        return len({record.at_us for record in self.records if record.mark is not trace.Mark.END})


def read_recording(data: bytes) -> RecordedRun:
    """Read a trace with a single device, even if its writer was killed in the middle of a line.

    Raises:
        TraceError: the data are not a trace of this version, or a line is damaged.
    """
    first, *lines = trace.trace_text(data).split("\n")
    header = trace.parse_header(first)
    records = tuple(trace.parse_records(lines[:-1]))
    ended = bool(records) and records[-1].mark is trace.Mark.END
    if not ended:
        records = tuple(r for r in records if r.at_us < records[-1].at_us)
    return RecordedRun(header, records, ended)


def replay(recording: RecordedRun, device: Emulated[bytes]) -> ReplayDifference[bytes] | None:
    """Replay a recording on a new device, and compare the device's output with the recording.

    Returns:
        The first difference, or None if the output is the same.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    records = recording.records
    received = ((r.at_us, r.data, r.line) for r in records if r.mark is trace.Mark.TO_DEVICE)
    changes = (
        _Change(r.at_us, partial(_set_signal, device, r))
        for r in records
        if r.mark is trace.Mark.PHYSICAL
    )
    sent = _play(device, received, changes, b"", recording.until_us)
    said = [(r.at_us, r.data, r.line) for r in records if r.mark is trace.Mark.FROM_DEVICE]
    return _first_difference(said, sent, b"")


def _set_signal(device: Emulated[bytes], record: trace.Record) -> None:
    if record.text == trace.RESET:
        device.reset()
        return
    try:
        device.inputs.set(*record.change)
    except ValueError as error:
        raise trace.TraceError(f"line {record.line}: {error}") from None


# Replay the recorded run of a bench, device by device.

_Traffic = bytes | Frames


@dataclass(frozen=True)
class BenchRecording:
    """Content of a trace with any number of devices, as `read_trace` returns it.

    Attributes:
        header: description of the devices and wires.
        records: lines of the trace in order.
        ended: whether the trace has its end line. If not, the writer was killed or its disk was
            full. The last tick may then be incomplete and is left out of `records`.
    """

    header: bench_header.BenchHeader
    records: tuple[BenchRecord, ...]
    ended: bool
    _by_name: dict[str, list[BenchRecord]] = field(
        init=False, repr=False, compare=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        for record in self.records:
            if record.mark is not trace.Mark.WIRE:
                self._by_name.setdefault(record.name, []).append(record)

    @property
    def until_us(self) -> int:
        """Duration of the recording."""
        return self.records[-1].at_us if self.records else 0

    @property
    def at_port(self) -> bool:
        """Whether the times come from a port tap at a host, not from ticks."""
        return self.header.place is bench_header.Place.PORT

    def to_pandas(self) -> pandas.DataFrame:
        """Return the lines as a DataFrame of pandas (`pip install 'tickrig[pandas]'`).

        The index `time_s` is the time since the beginning in seconds. Devices that tick together
        have the same `time_s`. The columns are:

        - `at_us`: the time in microseconds;
        - `name`: the name of the device or wire;
        - `mark`: `>` for data to the device, `<` for data from it, `!` for an action on it, `~` for
          a fault of a wire;
        - `text`: the text in the file;
        - `data`: the bytes;
        - `can_id`: the CAN-ID;
        - `input` and `value`: the name and the value of an input that was set.

        A cell is empty if the line has no such value.

        Raises:
            ImportError: pandas is not installed.
        """
        try:
            import pandas  # noqa: PLC0415 - an extra, and slow
        except ImportError:
            raise ImportError("to_pandas needs pandas: pip install 'tickrig[pandas]'") from None
        rows = [_row(record) for record in self.records if record.mark is not trace.Mark.END]
        frame = pandas.DataFrame(rows, columns=_COLUMNS)
        frame["can_id"] = frame["can_id"].astype("Int64")
        frame["at_us"] = frame["at_us"].astype("int64")
        return frame.set_index((frame["at_us"] / 1e6).rename("time_s"))

    def _repr_html_(self) -> str:
        """Return the devices and the first lines, for Jupyter."""
        devices = self.header.devices.items()
        rows = [(name, one.type or "made by a program", one.wire) for name, one in devices]
        lines = (
            (format_time(one.at_us), one.name, one.mark, one.written)
            for one in self.records
            if one.mark is not trace.Mark.END
        )
        facts = f"{self.until_us / 1e6:g} s", f"seed {self.header.seed}"
        return "".join(
            (
                notebook.heading("trace", *facts, *["not whole"] * (not self.ended)),
                notebook.table(("device", "type", "wire"), rows),
                notebook.table(("time s", "name", "mark", "text"), lines, "Lines", opened=True),
            )
        )

    def ticks_of(self, name: str) -> set[int]:
        """Return the times in microseconds at which a device had traffic or a change.

        Args:
            name: name of the device.
        """
        return {record.at_us for record in self.of(name)}

    def of(self, name: str) -> tuple[BenchRecord, ...]:
        """Return the lines of a device.

        Args:
            name: name of the device.
        """
        return tuple(self._by_name.get(name, ()))


_COLUMNS: Final = ["at_us", "name", "mark", "text", "data", "can_id", "input", "value"]


def _row(record: BenchRecord) -> tuple[object, ...]:
    """Return a line as cells of `_COLUMNS`."""
    traffic, is_traffic = (
        record.traffic,
        record.mark
        in (
            trace.Mark.TO_DEVICE,
            trace.Mark.FROM_DEVICE,
        ),
    )
    can_id = traffic.can_id if isinstance(traffic, CanFrame) else None
    payload = traffic.data if isinstance(traffic, CanFrame) else traffic
    data = payload if is_traffic else None
    change = record.change if record.mark is trace.Mark.PHYSICAL else None
    name, value = change or (None, None)
    return record.at_us, record.name, str(record.mark), record.written, data, can_id, name, value


def read_trace(path: Path | str) -> BenchRecording:
    """Read a trace file in either format: of a single device, or of a bench.

    Args:
        path: path of the file.

    Returns:
        The recording. If its writer was killed, the last tick is left out, because it may be
        incomplete.

    Raises:
        OSError: the file cannot be read.
        TraceError: the file is not a trace, or a line is damaged. TraceError is a ValueError.
    """
    return read_bench_recording(Path(path).read_bytes())


def read_bench_recording(data: bytes) -> BenchRecording:
    """Read the bytes of a trace in either format: of a single device, or of a bench.

    The writer may have been killed in the middle of a line.

    Raises:
        TraceError: the data are not a trace, or a line is damaged.
    """
    if not data.startswith(bench_header.PREFIX.encode()):
        return _as_bench(read_recording(data))
    first, *lines = trace.trace_text(data).split("\n")
    header = bench_header.parse_bench_header(first)
    records = tuple(BenchParser(header).parse(lines[:-1]))
    ended = bool(records) and records[-1].mark is trace.Mark.END
    if not ended:
        records = tuple(r for r in records if r.at_us < records[-1].at_us)
    return BenchRecording(header, records, ended)


def _as_bench(recording: RecordedRun) -> BenchRecording:
    """Return the recording of one device on a serial line as a recording of a bench."""
    name, wires = (
        recording.header.device,
        {"line": bench_header.WireEntry(bench_header.WireType.SERIAL)},
    )
    entry = bench_header.DeviceEntry("line", name, recording.header.config)
    records = tuple(
        BenchRecord(
            x.at_us, "" if x.mark is trace.Mark.END else name, x.mark, x.data, x.text, x.line
        )
        for x in recording.records
    )
    return BenchRecording(bench_header.BenchHeader({name: entry}, wires), records, recording.ended)


def replay_device(
    recording: BenchRecording, name: str, device: Device[Any]
) -> ReplayDifference[Any] | None:
    """Replay the traffic of a recorded device on a new device, and compare the output.

    Args:
        recording: recording of the bench.
        name: name of the recorded device.
        device: a new device of the same type.

    Returns:
        The first difference between recorded and new output, or None if there is none.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    nothing: _Traffic = () if recording.header.on_can(name) else b""
    said = [*traffic_of(recording.of(name), trace.Mark.FROM_DEVICE)]
    return _first_difference(said, play_device(recording, name, device), nothing)


def play_device(recording: BenchRecording, name: str, device: Device[Any]) -> list[tuple[int, Any]]:
    """Replay the traffic of a recorded device on a new device; return its output with the times.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    nothing: _Traffic = () if recording.header.on_can(name) else b""
    records = recording.of(name)
    received, physical = traffic_of(records, trace.Mark.TO_DEVICE), trace.Mark.PHYSICAL
    changes = [
        _Change(record.at_us, partial(do, device, record))
        for record in records
        if record.mark is physical
    ]
    return _play(device, received, changes, nothing, recording.until_us)


def traffic_of(
    records: Sequence[BenchRecord], mark: trace.Mark
) -> Iterator[tuple[int, _Traffic, int]]:
    """Yield the traffic of one direction as a tuple for each tick with traffic.

    The parts of the tuple are the time of the tick, all bytes or frames of the tick, and the number
    of the line in the trace at which these data begin.
    """
    together: list[Any] = []
    at_us = line = -1
    for record in [record for record in records if record.mark is mark]:
        if record.at_us != at_us:
            if together:
                yield at_us, _joined(together), line
            at_us, line, together = record.at_us, record.line, [record.traffic]
        else:
            together.append(record.traffic)
    if together:
        yield at_us, _joined(together), line


def _joined(together: list[Any]) -> _Traffic:
    """Return the traffic of a tick: bytes, or frames."""
    return b"".join(together) if isinstance(together[0], bytes) else tuple(together)


def do(device: Any, record: BenchRecord) -> None:
    """Repeat a recorded action on a device, such as a reset or a new value of an input.

    Raises:
        TraceError: an input is unknown, or a value is invalid.
    """
    try:
        if record.text == trace.RESET:
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
        raise trace.TraceError(f"line {record.line}: {record.name}: {error}") from None
