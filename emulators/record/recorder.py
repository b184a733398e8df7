"""Record what a device hears, says and suffers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from tickrig.device.physical import OutputSignal
from tickrig.device.twin import NonCopyable, itself
from tickrig.emulators.rig.emulated import Emulated, Inputs
from tickrig.host.text.log import log_of
from tickrig.host.text.trace import RESET, Header, Mark, Record
from tickrig.host.text.values import Setting

_logger = log_of(__name__)


class TraceFile(NonCopyable):
    """A trace on its way to a file; each tick is written at once, so a kill loses nothing.

    Where writing fails the recording ends with one warning, and the run goes on.

    Args:
        path: the file; one that exists is replaced.
        header: first line.

    Attributes:
        error: why the recording ended early, empty while all is well.

    Raises:
        OSError: the file cannot be opened.
    """

    why_not_copied = "it is an open file"

    def __init__(self, path: Path, header: Header) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        self._path = path
        self.error = ""
        self._write_lines([header.encode()])

    def write(self, records: list[Record]) -> None:
        """Append lines."""
        if self._fd >= 0 and records:
            self._write_lines([record.encode() for record in records])

    def close(self, now_us: int) -> None:
        """Write how long the run lasted, and close the file."""
        self.write([Record(now_us, Mark.END)])
        self._close()

    def _write_lines(self, lines: list[str]) -> None:
        data = "".join(f"{line}\n" for line in lines).encode("ascii")
        try:
            while data:
                data = data[os.write(self._fd, data) :]
        except OSError as error:
            self.error = f"{self._path}: {error.strerror}"
            _logger.warning("recording ended: %s; the emulator goes on", self.error)
            self._close()

    def _close(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1


class TracedDevice:
    """A device that is recorded; nobody around it can tell.

    Args:
        device: the device itself.
        trace: where the lines go.
    """

    def __init__(self, device: Emulated[bytes], trace: TraceFile) -> None:
        self._device, self._trace = device, trace
        self._seen: dict[str, Setting] = {
            item.name: item.initial for item in device.inputs.table.values()
        }
        self._was_reset = False

    def __reduce__(self) -> tuple[Callable[[object], object], tuple[object]]:
        """Copy the device alone: nobody records a twin."""
        return itself, (self._device,)

    @property
    def tick_us(self) -> int:
        """The device's period."""
        return self._device.tick_us

    @property
    def due_us(self) -> int:
        """When the device is due."""
        return self._device.due_us

    @property
    def inputs(self) -> Inputs:
        """The device's inputs."""
        return self._device.inputs

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The device's outputs."""
        return self._device.outputs

    def read(self, name: str, /) -> Setting:
        """Return an output of the device."""
        return self._device.read(name)

    def reset(self) -> None:
        """Reset the device; it is recorded with the next tick."""
        self._was_reset = True
        self._device.reset()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Tick the device and record it."""
        records = self._physical(now_us)
        if rx:
            records.append(Record(now_us, Mark.TO_DEVICE, rx))
        tx = self._device.tick(now_us, rx)
        if tx:
            records.append(Record(now_us, Mark.FROM_DEVICE, tx))
        self._trace.write(records)
        return tx

    def _physical(self, now_us: int) -> list[Record]:
        texts = [RESET] if self._was_reset else []
        self._was_reset = False
        if self._device.inputs.changed:
            for name, seen in self._seen.items():
                if (value := self._device.inputs[name]) != seen:
                    self._seen[name] = value
                    texts.append(f"{name}={value}")
        return [Record(now_us, Mark.PHYSICAL, text=text) for text in texts]
