"""What happens beside the frames of a run; the frames are in the candump log."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.bench.transcript import Transcript


class FrameTranscript(Transcript):
    """Touches, watched outputs and missed expectations, without the frames.

    Args:
        emulator: what is watched.
        write: takes the lines.
    """

    def __init__(self, emulator: RunningEmulator, write: Callable[[str], None]) -> None:
        super().__init__(emulator, write, lambda line: False)

    def send(self, now_us: int, data: bytes, shown: bytes) -> None:
        """Send a frame; the log shows it when it has passed."""
        self._emulator.send(now_us, data)
