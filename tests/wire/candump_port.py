"""Play a recorded CAN log to a device."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from tickrig.wire.can import CanFrame, Frames, LogLine
from tickrig.wire.instant import NEVER


class CandumpPort:
    """A `Port[Frames]` on which a log is heard, frame by frame, at the times it tells.

    Error frames are not played: a controller shows them to no application.

    Args:
        lines: the log.
        heard: which frames the device hears; all unless given. A log of a whole
            bus has the device's own frames too: leave those out.
        start_us: the time in the log at which the rig begins.

    Attributes:
        sent: what the device sent, each frame with its tick.
    """

    def __init__(
        self,
        lines: Iterable[LogLine],
        heard: Callable[[CanFrame], bool] = lambda frame: True,
        start_us: int = 0,
    ) -> None:
        self._heard = deque(
            (line.at_us - start_us, line.received)
            for line in lines
            if isinstance(line.received, CanFrame) and heard(line.received)
        )
        self.sent: list[tuple[int, CanFrame]] = []

    @property
    def due_us(self) -> int:
        """When the next frame of the log will have ended."""
        return self._heard[0][0] if self._heard else NEVER

    def poll(self, now_us: int, /) -> Frames:
        """Take the frames that had ended by `now_us`."""
        frames = []
        while self._heard and self._heard[0][0] <= now_us:
            frames.append(self._heard.popleft()[1])
        return tuple(frames)

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Keep what the device says."""
        self.sent += [(now_us, frame) for frame in traffic]
