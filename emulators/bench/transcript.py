"""What happens in a run, line by line, for people and golden files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import read_signal
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time

STATE: Final = "state"
"""The output that is watched unasked, where a device has one."""


class Transcript:
    """Writes lines of the wire as the host sees them, actions of the operator, watched outputs.

    Args:
        emulator: what is watched.
        write: takes the lines.
        wanted: which lines of the wire are worth it.
    """

    def __init__(
        self,
        emulator: RunningEmulator,
        write: Callable[[str], None],
        wanted: Callable[[WireLine], bool] = lambda line: True,
    ) -> None:
        self._emulator, self._write, self._wanted = emulator, write, wanted
        self._shown: dict[str, Setting] = {}
        self._sending = False
        emulator.operator.note = lambda text: self.write(emulator.effective_us, "!", text)
        emulator.log.listeners.append(self._hear)
        emulator.after_step.append(self._write_changes)
        if STATE in emulator.device.outputs:
            self.watch(emulator.effective_us, STATE)

    def write(self, now_us: int, mark: str, text: str) -> None:
        """Write a line."""
        self._write(f"{format_time(now_us)} {mark} {text}".rstrip())

    def watch(self, now_us: int, *names: str) -> None:
        """Show outputs now and whenever they change."""
        for name in names:
            self._shown.setdefault(name, "")
        self._write_changes(now_us)

    def send(self, now_us: int, data: bytes, shown: bytes) -> None:
        """Send as the host, and show it at once, line or not."""
        self.write(now_us, Mark.TO_DEVICE, escape(shown))
        self._sending = True
        self._emulator.send(now_us, data)
        self._sending = False

    def _write_changes(self, now_us: int) -> None:
        for name, shown in self._shown.items():
            if (value := read_signal(self._emulator.device, name)) != shown:
                self._shown[name] = value
                self.write(now_us, "*", f"{name} {value}")

    def _hear(self, line: WireLine) -> None:
        if not self._sending and self._wanted(line):
            self.write(line.at_us, line.mark, escape(line.data))


class FrameTranscript(Transcript):
    """Actions of the operator, watched outputs and missed expectations, without the frames.

    Args:
        emulator: what is watched.
        write: takes the lines.
    """

    def __init__(self, emulator: RunningEmulator, write: Callable[[str], None]) -> None:
        super().__init__(emulator, write, lambda line: False)

    def send(self, now_us: int, data: bytes, shown: bytes) -> None:
        """Send a frame; the log shows it when it has passed."""
        self._emulator.send(now_us, data)
