"""A slave in virtual time under a test that sends, expects, counts and waits.

Frames are matched as text in candump's notation. A frame that was received and
not yet expected stays unread, per COB-ID, until a step takes or forgets it.
"""

from __future__ import annotations

import re
from collections import defaultdict, deque
from enum import Enum
from typing import Final

from tickrig.device.canopen.slave import TICK_US
from tickrig.device.core import Device
from tickrig.wire.can import CanFrame, Frames

MS_US: Final = 1_000


class Pace(Enum):
    """When queued frames go over the bus, and which ticks are run."""

    SINGLE = "one frame a tick"
    BURST = "all frames in one tick"
    SPARSE = "one frame a tick, idle ticks left out"


class Runner:
    """A slave, the time and the frames that the test has not read yet.

    Args:
        slave: fresh, not yet powered.
        pace: when frames go over the bus.
    """

    def __init__(self, slave: Device[Frames], pace: Pace = Pace.SINGLE) -> None:
        self.slave, self.pace = slave, pace
        self.now_us = 0
        self.transcript: list[str] = []
        self._queue: deque[CanFrame] = deque()
        self._unread: defaultdict[int, deque[str]] = defaultdict(deque)

    def boot(self) -> None:
        """Switch on and forget the boot-up message."""
        self.wait(1)
        self._unread.clear()

    def send(self, text: str, *, extended: bool = False) -> None:
        """Send a frame: candump notation, or `705R1` for a remote frame with DLC 1."""
        frame = CanFrame.parse(re.sub(r"^(...)R", r"\1#R", text))
        self._queue.append(frame._replace(extended=extended))
        if self.pace is not Pace.BURST:
            self._advance(self.now_us)

    def expect(self, patterns: list[str], within_ms: int) -> str:
        """Wait for the next frame on a COB-ID; it must match one of the patterns."""
        cob_id = int(patterns[0][:3], 16)
        end_us = self.now_us + within_ms * MS_US
        while self._queue or (not self._unread[cob_id] and self.now_us < end_us):
            self._advance(end_us)
        wanted = " or ".join(patterns[:4]) + (" .." if len(patterns) > 4 else "")
        if not self._unread[cob_id]:
            raise AssertionError(f"no {wanted} within {within_ms} ms")
        got = self._unread[cob_id].popleft()
        if not any(matches(pattern, got) for pattern in patterns):
            raise AssertionError(f"got {got}, want {wanted}")
        return got

    def none(self, cob_id: int, for_ms: int) -> None:
        """Wait; no frame on the COB-ID may come or be unread."""
        self.wait(for_ms)
        if self._unread[cob_id]:
            raise AssertionError(f"unexpected {self._unread[cob_id][0]}")

    def count(self, pattern: str, for_ms: int, least: int, most: int) -> None:
        """Wait; so many frames that match must come meanwhile."""
        unread = self._unread[int(pattern[:3], 16)]
        unread.clear()
        self.wait(for_ms)
        got = sum(matches(pattern, text) for text in unread)
        unread.clear()
        if not least <= got <= most:
            raise AssertionError(f"{got} x {pattern} in {for_ms} ms, want {least}..{most}")

    def unread(self, cob_id: int) -> deque[str]:
        """Return the frames of a COB-ID that nobody has read."""
        return self._unread[cob_id]

    def forget(self, cob_id: int) -> None:
        """Forget the unread frames of a COB-ID."""
        self.flush()
        self._unread[cob_id].clear()

    def wait(self, for_ms: int) -> None:
        """Let time pass."""
        self.flush()
        end_us = self.now_us + for_ms * MS_US
        while self.now_us < end_us:
            self._advance(end_us)

    def flush(self) -> None:
        """Send what is queued."""
        if self._queue:
            self._advance(self.now_us)

    def power(self) -> None:
        """Cut the power for a moment; unread frames are forgotten."""
        self.note("power cycle")
        self._queue.clear()
        self._unread.clear()
        self.slave.reset()

    def _advance(self, end_us: int) -> None:
        """Run the next tick that is to be run, at the latest the one at `end_us`."""
        step_us = TICK_US
        if self.pace is Pace.SPARSE and not self._queue:
            next_us = -(-min(self.slave.due_us, end_us) // TICK_US) * TICK_US
            step_us = max(TICK_US, next_us - self.now_us)
        self.now_us += step_us
        frames = tuple(self._queue)
        self._queue.clear()
        for frame in frames:
            self.note(f"> {frame}")
        for frame in self.slave.tick(self.now_us, frames):
            self.note(f"< {frame}")
            self._unread[frame.can_id].append(str(frame))

    def note(self, text: str) -> None:
        """Add a line to the transcript."""
        self.transcript.append(f"{self.now_us / 1e6:9.3f} {text}")


def matches(pattern: str, text: str) -> bool:
    """Compare frames; a dot stands for any nibble.

    >>> matches("585#4F011000........", "585#4F01100003000000")
    True
    """
    return re.fullmatch(pattern, text) is not None
