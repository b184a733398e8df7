"""Record what a device hears, says and suffers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, SupportsIndex, TypeVar

from tickrig.device.core import Device, W
from tickrig.device.horizon import Horizon
from tickrig.device.physical import OutputSignal
from tickrig.device.twin import NonCopyable, itself
from tickrig.emulators.rig.emulated import Inputs
from tickrig.host.text.bench_record import BUS_STATE, change_text
from tickrig.host.text.line_file import LineFile
from tickrig.host.text.trace import RESET, Header, Mark, Record
from tickrig.host.text.values import Setting
from tickrig.wire.can_error import ErrorState


class TraceFile(NonCopyable):
    """A trace on its way to a file; each tick is written at once, so a kill loses nothing.

    Where writing fails the recording ends with one warning, and the run goes on.

    Args:
        path: the file; one that exists is replaced.
        header: first line.

    Raises:
        OSError: the file cannot be opened.
    """

    why_not_copied = "it is an open file"
    keeps = False

    def __init__(self, path: Path, header: Header) -> None:
        self._file = LineFile(path, header.encode())

    @property
    def error(self) -> str:
        """Why the recording ended early, empty while all is well."""
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
        """Write how long the run lasted, and close the file."""
        self._file.close(Record(now_us, Mark.END).encode())


W_contra = TypeVar("W_contra", contravariant=True)


class Trace(Protocol[W_contra]):
    """Where the ticks of a device are recorded."""

    @property
    def keeps(self) -> bool:
        """Whether a copy of the device is recorded as well, in memory."""
        ...

    def hear(self, now_us: int, done: Sequence[str], received: W_contra, sent: W_contra) -> None:
        """Take what was done to the device before a tick, and its traffic in it."""


class TracedDevice(Generic[W]):
    """A device that is recorded; nobody around it can tell.

    What is recorded of it: its traffic, changes of its `inputs`, resets, what its CAN
    controller tells it, and all that it tells itself to `on_set` if it has that, as a node
    does of its objects.

    Args:
        device: the device itself.
        trace: where the ticks go.
    """

    def __init__(self, device: Device[W], trace: Trace[W]) -> None:
        self._device: Any = device
        self._trace = trace
        bank: Inputs | None = getattr(device, "inputs", None)
        self._bank = bank
        self._seen: dict[str, Setting] = (
            {} if bank is None else {item.name: item.initial for item in bank.table.values()}
        )
        self._done: list[str] = []
        self._follow()

    def _follow(self) -> None:
        """Hear of what is set, also to the value that it has."""
        if hasattr(self._device, "on_set"):
            self._device.on_set = self._set

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> Any:
        """Copy the device alone where nobody records a copy."""
        if self._trace.keeps:
            return super().__reduce_ex__(protocol)
        return itself, (self._device,)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Go on recording, as a copy."""
        vars(self).update(state)
        self._follow()

    @property
    def tick_us(self) -> int:
        """The device's period."""
        return int(self._device.tick_us)

    @property
    def due_us(self) -> int:
        """When the device is due; at once where a reset is to be recorded."""
        if self._done:
            return 0  # a tick that is not due changes nothing, and a replay resets where it was
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
    def horizon(self) -> Horizon | None:
        """How far the device may work ahead."""
        return getattr(self._device, "horizon", None)

    @horizon.setter
    def horizon(self, horizon: Horizon | None) -> None:
        if hasattr(self._device, "horizon"):
            self._device.horizon = horizon

    @property
    def accepts(self) -> frozenset[int] | None:
        """CAN-IDs that the device listens to; None for all."""
        return getattr(self._device, "accepts", None)

    @property
    def reconfigured_by(self) -> frozenset[int]:
        """CAN-IDs of the frames that may change `accepts`."""
        return getattr(self._device, "reconfigured_by", frozenset())

    @property
    def on_accepts(self) -> list[Callable[[], None]]:
        """Whom to call when these two have changed."""
        return getattr(self._device, "on_accepts", [])

    def bus_state(self, state: ErrorState, /) -> None:
        """Hand on what the CAN controller tells; it is recorded with the next tick."""
        if hasattr(self._device, "bus_state"):
            self._done.append(_BUS_STATE[state])
            self._device.bus_state(state)

    def reset(self) -> None:
        """Reset the device; it is recorded with the next tick."""
        self._done.append(RESET)
        self._device.reset()

    def tick(self, now_us: int, rx: W, /) -> W:
        """Tick the device and record it."""
        if self._bank is not None and self._bank.changed:
            self._look()
        done: Sequence[str] = ()
        if self._done:
            done, self._done = self._done, []
        tx: W = self._device.tick(now_us, rx)
        self._trace.hear(now_us, done, rx, tx)
        return tx

    def _set(self, name: str, value: Setting) -> None:
        """Note what was set."""
        self._done.append(change_text(name, value))
        if name in self._seen:
            self._seen[name] = value

    def _look(self) -> None:
        """Note what has changed in the bank."""
        bank = self.inputs
        for name, seen in self._seen.items():
            if (value := bank[name]) != seen:
                self._set(name, value)


_BUS_STATE = {state: text for text, state in BUS_STATE.items()}
