"""Record the traffic, inputs and faults of devices."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final, Generic, NamedTuple, Protocol, SupportsIndex, TypeVar

from tickrig.device.core import Device, W
from tickrig.device.horizon import Horizon
from tickrig.device.physical import OutputSignal
from tickrig.device.twin import Copyable, Immutable, NonCopyable, itself
from tickrig.emulators.rig.emulated import Inputs
from tickrig.host.text.bench_header import BenchHeader
from tickrig.host.text.bench_record import BUS_STATE, BenchRecord, change_text
from tickrig.host.text.log import log_of
from tickrig.host.text.trace import RESET, Header, Mark, Record
from tickrig.host.text.values import Setting
from tickrig.host.text.whole_file import LineFile, write_whole
from tickrig.wire.can import CanFrame, ErrorFrame, ErrorState, LogLine
from tickrig.wire.uart import UartSetting


class TraceFile(NonCopyable):
    """A trace file that is written during a run, line by line.

    Each tick of the device is written at once, so no tick is lost if the process is killed. If
    writing fails, the recording ends with one warning, and the run continues.

    Args:
        path: path of the file; an existing file is replaced.
        header: first line of the trace.

    Raises:
        OSError: the file cannot be opened.
    """

    why_not_copied = "it is an open file"
    keeps = False

    def __init__(self, path: Path, header: Header) -> None:
        self._file = LineFile(path, header.encode())

    @property
    def error(self) -> str:
        """Reason why the recording ended early, or "" if there was no error."""
        return self._file.error

    def hear(self, now_us: int, done: Sequence[str], received: bytes, sent: bytes) -> None:
        """Append the lines of a tick."""
        records = [Record(now_us, Mark.PHYSICAL, text=text) for text in done]
        if received:
            records.append(Record(now_us, Mark.TO_DEVICE, received))
        if sent:
            records.append(Record(now_us, Mark.FROM_DEVICE, sent))
        self.write(records)

    def write(self, records: list[Record]) -> None:
        """Append lines."""
        self._file.write([record.encode() for record in records])

    def close(self, now_us: int) -> None:
        """Write the duration of the run, and close the file."""
        self._file.close(Record(now_us, Mark.END).encode())


_W_contra = TypeVar("_W_contra", contravariant=True)


class _Trace(Protocol[_W_contra]):
    """Storage of the recorded ticks of a device."""

    @property
    def keeps(self) -> bool:
        """Whether a copy of the device is also recorded, in memory."""
        ...

    def hear(self, now_us: int, done: Sequence[str], received: _W_contra, sent: _W_contra) -> None:
        """Record the actions on the device before a tick, and its traffic in the tick."""


class DeviceBefore(Generic[W]):
    """Wrapper of a device, with the same interface as the device.

    Subclasses change or record the traffic of the wrapped device.

    Args:
        device: the wrapped device.
    """

    def __init__(self, device: Device[W]) -> None:
        self._device: Any = device

    @property
    def tick_us(self) -> int:
        """The device's period."""
        return int(self._device.tick_us)

    @property
    def due_us(self) -> int:
        """Time at which the device is due."""
        return self._device.due_us  # type: ignore[no-any-return]  # a Device

    @property
    def inputs(self) -> Inputs:
        """The device's inputs."""
        return self._device.inputs  # type: ignore[no-any-return]  # if it has some

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The device's outputs."""
        return self._device.outputs  # type: ignore[no-any-return]  # if it has some

    def read(self, name: str, /) -> Setting:
        """Return an output of the device."""
        return self._device.read(name)  # type: ignore[no-any-return]  # if it has some

    @property
    def uart(self) -> UartSetting | None:
        """The UART setting of the device, if the setting can change."""
        return getattr(self._device, "uart", None)

    @property
    def horizon(self) -> Horizon | None:
        """Time limits up to which the device may compute ahead."""
        return getattr(self._device, "horizon", None)

    @horizon.setter
    def horizon(self, horizon: Horizon | None) -> None:
        if hasattr(self._device, "horizon"):
            self._device.horizon = horizon

    @property
    def accepts(self) -> frozenset[int] | None:
        """CAN-IDs that the device receives, or None for all."""
        return getattr(self._device, "accepts", None)

    @property
    def reconfigured_by(self) -> frozenset[int]:
        """CAN-IDs of the frames that may change `accepts`."""
        return getattr(self._device, "reconfigured_by", frozenset())

    @property
    def on_accepts(self) -> list[Callable[[], None]]:
        """Callback for a change of `accepts` or `reconfigured_by`."""
        return getattr(self._device, "on_accepts", [])

    def bus_state(self, state: ErrorState, /) -> None:
        """Forward a report of the CAN controller."""
        if hasattr(self._device, "bus_state"):
            self._device.bus_state(state)

    def reset(self) -> None:
        """Reset the device."""
        self._device.reset()


class TracedDevice(DeviceBefore[W]):
    """Wrapper that records a device in a trace; the wrapper has the interface of the device.

    The wrapper records the device's traffic, changes of the device's `inputs`, resets, and the
    states that the CAN controller reports. If the device has a callback `on_set`, as a CANopen node
    has, the wrapper uses the callback to record each signal that is set.

    Args:
        device: the device to record.
        trace: storage that gets the recorded ticks.
    """

    def __init__(self, device: Device[W], trace: _Trace[W]) -> None:
        super().__init__(device)
        self._trace = trace
        bank: Inputs | None = getattr(device, "inputs", None)
        self._bank = bank
        self._seen: dict[str, Setting] = (
            {} if bank is None else {item.name: item.initial for item in bank.table.values()}
        )
        self._done: list[str] = []
        self._follow()

    def _follow(self) -> None:
        """Receive each set value, even an unchanged one."""
        if hasattr(self._device, "on_set"):
            self._device.on_set = self._set

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> Any:
        """Copy only the device if copies are not recorded."""
        if self._trace.keeps:
            return super().__reduce_ex__(protocol)
        return itself, (self._device,)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue recording in a copy."""
        vars(self).update(state)
        self._follow()

    @property
    def due_us(self) -> int:
        """Time at which the device must be called next, or 0 for the next tick.

        The time is 0 if the device was changed, for example by a reset, because the next call of
        `tick` records the change.
        """
        if self._done:
            return 0  # a tick that is not due changes nothing, and a replay resets where it was
        return self._device.due_us  # type: ignore[no-any-return]  # a Device, asked in each tick

    def bus_state(self, state: ErrorState, /) -> None:
        """Forward a state of the CAN controller to the device, and record it with the next tick."""
        if hasattr(self._device, "bus_state"):
            self._done.append(_BUS_STATE[state])
        super().bus_state(state)

    def reset(self) -> None:
        """Reset the device; the reset is recorded with the next tick."""
        self._done.append(RESET)
        super().reset()

    def tick(self, now_us: int, rx: W, /) -> W:
        """Tick the device and record the tick."""
        if self._bank is not None and self._bank.changed:
            self._look()
        done: Sequence[str] = ()
        if self._done:
            done, self._done = self._done, []
        tx: W = self._device.tick(now_us, rx)
        self._trace.hear(now_us, done, rx, tx)
        return tx

    def _set(self, name: str, value: Setting) -> None:
        """Record a set value."""
        self._done.append(change_text(name, value))
        if name in self._seen:
            self._seen[name] = value

    def _look(self) -> None:
        """Record the changes of the inputs."""
        bank = self.inputs
        for name, seen in self._seen.items():
            if (value := bank[name]) != seen:
                self._set(name, value)


_BUS_STATE = {state: text for text, state in BUS_STATE.items()}


# Record a bench: traffic, inputs and faults of each device.


class Tick(NamedTuple):
    """The part of a recording about one device in one tick, or about a wire at one time.

    Attributes:
        at_us: time of the tick or of the action on the wire, in microseconds.
        name: name of the device or wire.
        done: actions before the tick, such as `stick=5`.
        received: bytes or frames that the device received.
        sent: bytes or frames that the device sent.
        mark: mark of the actions in the trace: `!` if `name` is the name of a device, `~` if `name`
            is the name of a wire.
    """

    at_us: int
    name: str
    done: Sequence[str]
    received: Any = b""
    sent: Any = b""
    mark: Mark = Mark.PHYSICAL

    def lines(self) -> Iterator[str]:
        """Return the lines of the tick as text, without LF."""
        return (record.encode() for record in self.records())

    def records(self) -> Iterator[BenchRecord]:
        """Yield the lines of the tick."""
        at_us, name = self.at_us, self.name
        for text in self.done:
            yield BenchRecord(at_us, name, self.mark, text=text)
        for mark, traffic in ((Mark.TO_DEVICE, self.received), (Mark.FROM_DEVICE, self.sent)):
            for item in (traffic,) if isinstance(traffic, bytes) else traffic:
                if item:
                    yield BenchRecord(at_us, name, mark, item)


class TraceRecorder(Copyable):
    r"""Records the devices of a bench, in memory or in a file.

    Without a file the recorder keeps the recording for `save`. The latest ticks are in memory.
    Earlier ticks are in a temporary file as text, so memory does not grow with the run. The file is
    deleted with the recorder. A copy of the bench starts with the present recording and continues
    it on its own.

    With a file each tick is written at once, so a kill loses only the last tick. If writing fails,
    the recording ends with one warning, and the run continues. Copies are not recorded.

    Args:
        path: path of the file, which is replaced, or None to keep the lines for `save`.
        header: description of the bench.

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
        self._shared: tuple[_Ticks | _Lines, ...] = ()  # ticks in memory come last
        self._ticks: list[Tick] = []
        self._spool, self._in_memory = _Spool(), 0
        self._last_us = 0

    def device(self, name: str, device: Device[W]) -> TracedDevice[W]:
        """Return a wrapper that records a device, to be put on a rig in place of the device.

        Args:
            name: name of the device in the header.
            device: the device. From its first tick on, the traffic of the device and the changes of
                its `inputs` are recorded. For a CANopen node, each object that is set by name is
                recorded, too.

        Raises:
            KeyError: the header has no such device.
        """
        self.header.devices[name]
        return TracedDevice(device, _Channel(name, self))

    def wire_fault(self, now_us: int, wire: str, text: str) -> None:
        """Record the start or end of a fault on a wire.

        Args:
            now_us: time of the change in microseconds.
            wire: name of the wire in the header.
            text: text of the fault, such as `cut` or `drop=0.1`, or `cut=0` for the end of the
                fault `cut`.
        """
        self.add(Tick(now_us, wire, (text,), mark=Mark.WIRE))

    @property
    def error(self) -> str:
        """Reason why the recording ended early, or "" if there was no error."""
        return self._file.error if self._file else ""

    @property
    def keeps(self) -> bool:
        """Whether the recorder keeps the recording in memory."""
        return not self._forgetful

    def add(self, tick: Tick) -> None:
        """Record events; the run lasts at least until their time."""
        self._last_us = max(self._last_us, tick.at_us)
        if not self._forgetful:
            self._ticks.append(tick)
            self._in_memory += 1
            if self._in_memory >= TICKS_KEPT:
                self._write_down()
        elif self._file is not None:
            self._file.write([*tick.lines()])

    def _write_down(self) -> None:
        """Convert the ticks in memory to text."""
        parts = (*(part for part in self._shared if isinstance(part, _Ticks)), _Ticks(self._ticks))
        text = "".join(f"{line}\n" for part in parts for line in part.lines())
        written = tuple(part for part in self._shared if isinstance(part, _Lines))
        self._shared = (*written, self._spool.keep(text))
        self._ticks, self._in_memory = [], 0

    def lines(self, now_us: int) -> Iterator[str]:
        """Yield the lines of the trace, with an end line that has the present time.

        Args:
            now_us: present time of the rig in microseconds.
        """
        yield self.header.encode()
        for part in (*self._shared, _Ticks(self._ticks)):
            yield from part.lines()
        yield BenchRecord(max(now_us, self._last_us), "", Mark.END).encode()

    def save(self, path: Path, now_us: int) -> None:
        """Write the recording, which is kept in memory, to a trace file.

        Args:
            path: path of the file; an existing file is replaced.
            now_us: present time of the rig in microseconds.

        Raises:
            ValueError: the run is not kept in memory, because it is already recorded in a file.
            OSError: the file cannot be written.
        """
        if self._forgetful:
            raise ValueError("the run is recorded in a file already")
        write_whole(path, "".join(f"{line}\n" for line in self.lines(now_us)))

    def close(self, now_us: int) -> None:
        """Write the duration of the run to the file, and close the file."""
        if self._file is not None:
            self._file.close(BenchRecord(max(now_us, self._last_us), "", Mark.END).encode())

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a copy; the recording so far is shared."""
        if self._ticks:
            self._shared, self._ticks = (*self._shared, _Ticks(tuple(self._ticks))), []
        return {**vars(self), "_file": None, "_spool": _Spool()}


TICKS_KEPT: Final = 4_096
"""Largest number of ticks in memory before they are written as text."""


@dataclass(frozen=True, slots=True)
class _Ticks(Immutable):
    """Ticks shared by a recorder and its copies."""

    ticks: Sequence[Tick]

    def lines(self) -> Iterator[str]:
        """Yield the lines of the ticks, without LF."""
        for tick in self.ticks:
            yield from tick.lines()


class _Spool:
    """An append-only temporary file; if the file cannot be written, the text stays in memory.

    Copies within the process share the part that is already written. Each copy appends to a file of
    its own.
    """

    shared_by_twins = True

    def __init__(self) -> None:
        self._file: IO[bytes] | None = None
        self._size, self._failed = 0, False

    def keep(self, text: str) -> _Lines:
        """Append a text."""
        from tempfile import TemporaryFile  # noqa: PLC0415 - slow, and most runs are short

        data = text.encode()
        if not self._failed:
            try:
                self._file = self._file or TemporaryFile()  # noqa: SIM115 - it stays open
                self._file.seek(self._size)
                self._file.write(data)
                self._file.flush()
            except OSError as error:
                self._failed = True
                _logger.warning("a trace stays in memory: no temporary file: %s", error.strerror)
            else:
                self._size += len(data)
                return _Lines(b"", self, self._size - len(data), len(data))
        return _Lines(data)

    def __del__(self) -> None:
        """Remove the file."""
        if self._file is not None:
            self._file.close()

    def read(self, start: int, size: int) -> bytes:
        """Return the stored text."""
        if self._file is None:
            return b""
        self._file.seek(start)
        return self._file.read(size)


class _Lines(Immutable):
    """Lines shared by a recorder and its copies; a pickle contains them."""

    def __init__(
        self, data: bytes, spool: _Spool | None = None, start: int = 0, size: int = 0
    ) -> None:
        self._data, self._spool, self._start, self._size = data, spool, start, size

    @property
    def _text(self) -> bytes:
        if self._spool is None:
            return self._data
        return self._spool.read(self._start, self._size)

    def lines(self) -> Iterator[str]:
        """Return the lines, without LF."""
        return iter(self._text.decode().split("\n")[:-1])

    def __reduce__(self) -> Any:
        """Pickle the lines themselves, for another process."""
        return _Lines, (self._text,)


class _Channel(NamedTuple):
    """Storage for the recording of a device."""

    name: str
    recorder: TraceRecorder

    @property
    def keeps(self) -> bool:
        return self.recorder.keeps

    def hear(self, now_us: int, done: Sequence[str], received: Any, sent: Any) -> None:
        if done or received or sent:
            self.recorder.add(Tick(now_us, self.name, done, received, sent))


# Record a CAN bus in a file that the can-utils read.

_logger = log_of(__name__)


class CandumpFile:
    """Log of a CAN bus in candump's format, written to a file during a run.

    Each line is written at once, so no line is lost if the process is killed. If writing fails, the
    recording ends with one warning, and the run continues. Use the method `hear` as observer of a
    `CanWire`.

    Args:
        path: path of the file; an existing file is replaced.
        channel: name of the bus in the log.

    Attributes:
        error: reason why the recording ended early, or empty if there was no error.

    Raises:
        ValueError: the channel is empty, or has blanks.
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, channel: str = "vcan0") -> None:
        if not channel or channel.split() != [channel]:
            raise ValueError(f"channel {channel!r} is not a name without blanks")
        self._path, self._channel, self.error = path, channel, ""
        self._file = path.open("w", buffering=1, encoding="ascii")

    def hear(self, at_us: int, received: CanFrame | ErrorFrame) -> None:
        """Write a frame of the bus."""
        if self.error:
            return
        try:
            self._file.write(f"{LogLine(at_us, self._channel, received)}\n")
        except OSError as error:
            self.error = f"{self._path}: {error.strerror}"
            _logger.warning("recording ended: %s; the emulator goes on", self.error)

    def close(self, now_us: int = 0) -> None:
        """Close the file; the time is not written. Closing it again has no effect."""
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or f"{self._path}: {error.strerror}"
