"""The latest lines, or frames, on a serial line, in both directions."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from tickrig.emulators.record.frames import FrameLog
from tickrig.emulators.rig.rig import Rig
from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.instant import NEVER
from tickrig.wire.lines import LineSplitter


@dataclass(frozen=True, slots=True)
class WireLine:
    """A line of text or a frame on a wire, as an entry of a `WireLog`.

    Attributes:
        number: number of the entry in the run, counted from 1.
        at_us: time of the last byte, in microseconds.
        mark: direction: to the device or from the device.
        data: content without the end of line.
        source: name of the wire or device, if there are several.
    """

    number: int
    at_us: int
    mark: Mark
    data: bytes
    source: str = ""


_MOST_BEGUN: Final = 4_096
"""Largest number of bytes kept of a line without an end."""

_LINE_ENDS: Final = b"\r\n"

Splitter = Callable[[int, bytes], list[bytes]]
"""Function that gets received bytes and their time, and returns the completed lines."""


def line_splitter(mark: Mark) -> Splitter:
    """Return a splitter of one direction into lines."""
    splitter = LineSplitter()
    return lambda at_us, data: splitter.push(data)


class WireLog:
    """Log of a wire: splits traffic into lines or frames, keeps the latest, and calls listeners.

    Args:
        keep: number of lines to keep.
        splitter: function that makes the splitter for a direction. The default splits at the ends
            of lines.

    Attributes:
        listeners: functions that are called with each complete line.
    """

    def __init__(
        self, keep: int = 500, splitter: Callable[[Mark], Splitter] = line_splitter
    ) -> None:
        self.listeners: list[Callable[[WireLine], None]] = []
        self._lines: deque[tuple[int, int, Mark, bytes | CanFrame | ErrorFrame, str]]
        self._lines = deque(maxlen=keep)
        self._splitters = {mark: splitter(mark) for mark in (Mark.TO_DEVICE, Mark.FROM_DEVICE)}
        self._begun = dict.fromkeys(self._splitters, (0, b""))
        self._count = 0
        self._wake: Callable[[int], None] | None = None

    def follow(self, rig: Rig, name: str) -> None:
        """From now on, log a frame as soon as the silence after the frame is long enough.

        This is for lines on which a silence ends a frame. Without this call such a frame is logged
        only when the next traffic arrives.

        Args:
            rig: the rig with the line. Its time shows when a silence is long enough.
            name: name of the serial line.
        """
        logs = self._splitters.values()
        if any(isinstance(each, FrameLog) and each.ends_by_time for each in logs):
            self._wake = partial(rig.event_queue.wake, ("silence", name))
            rig.watchers.append(self.end_silent)

    def hear(self, at_us: int, mark: Mark, data: bytes) -> None:
        """Add traffic, in chunks of any size."""
        self.end_silent(at_us)
        splitter = self._splitters[mark]
        if isinstance(splitter, FrameLog):
            for line in splitter(at_us, data):
                self.add(at_us, mark, line)
            self._begun[mark] = at_us, splitter.begun
            self._wake_at_silence()
            return
        begun = (self._begun[mark][1] + data)[-_MOST_BEGUN:]
        for line in splitter(at_us, data):
            self.add(at_us, mark, line)
            begun = begun[begun.find(line) + len(line) :].lstrip(_LINE_ENDS)
        self._begun[mark] = at_us, begun

    def end_silent(self, at_us: int) -> None:
        """Add frames that a silence has ended, at the time of their last byte."""
        for mark, splitter in self._splitters.items():
            if isinstance(splitter, FrameLog) and splitter.due_us <= at_us:
                for line in splitter(at_us, b""):
                    self.add(splitter.last_us, mark, line)
                self._begun[mark] = at_us, b""
                self._wake_at_silence()

    def _wake_at_silence(self) -> None:
        logs = self._splitters.values()
        due_us = min((each.due_us for each in logs if isinstance(each, FrameLog)), default=NEVER)
        if self._wake is not None and due_us < NEVER:
            self._wake(due_us)

    def unfinished(self, *, by_gap: bool = False) -> tuple[WireLine, ...]:
        """Return the lines or frames that have not ended yet, at most one of each direction.

        The attribute `number` of the returned entries is 0.

        Args:
            by_gap: whether to return only frames that end by a silence on the line. All bytes of
                such a frame may have arrived, but the silence is still too short. With False, the
                result contains only lines, and frames whose end is known from their bytes.
        """
        return tuple(
            WireLine(0, at_us, mark, data)
            for mark, (at_us, data) in self._begun.items()
            if data and by_gap == getattr(self._splitters[mark], "gap_alone", False)
        )

    def add(
        self, at_us: int, mark: Mark, line: bytes | CanFrame | ErrorFrame, source: str = ""
    ) -> None:
        """Add a complete line or frame to the log, and call the listeners."""
        self._count += 1
        whole = (self._count, at_us, mark, line, source)
        self._lines.append(whole)
        for listener in self.listeners:
            listener(_written(*whole))

    def since(self, number: int) -> tuple[WireLine, ...]:
        """Return the kept lines after the line with a number."""
        return tuple(_written(*line) for line in self._lines if line[0] > number)


def _written(
    number: int, at_us: int, mark: Mark, line: bytes | CanFrame | ErrorFrame, source: str
) -> WireLine:
    data = line if isinstance(line, bytes) else str(line).encode()
    return WireLine(number, at_us, mark, data, source)
