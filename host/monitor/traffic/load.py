"""Bus load from the exact length of each frame, stuff bits and interframe space included."""

from __future__ import annotations

from typing import Final, NamedTuple

WINDOW_US: Final = 1_000_000


class Window(NamedTuple):
    """A second of a bus.

    Attributes:
        at_us: its begin.
        bits: how many bits of frames ended in it.
    """

    at_us: int
    bits: int


class LoadRow(NamedTuple):
    """How busy a bus was. Error frames and broken frames are not in it: nobody tells their length.

    Attributes:
        bits: of all frames.
        latest: the latest second that is over, or the first one while it is not.
        peak: the busiest second, the first of them.
        mean_bit_s: bits a second from the first window to the one with the latest frame.
    """

    bits: int
    latest: Window
    peak: Window
    mean_bit_s: int


class Load:
    """Adds up the bits of each second, counted from the first frame.

    A frame with an earlier time than one before it counts for the window that is open.
    """

    __slots__ = ("_bits", "_ended", "_first_us", "_open", "_peak")

    def __init__(self, first_us: int) -> None:
        self._first_us, self._bits = first_us, 0
        self._open = self._ended = self._peak = Window(first_us, 0)

    def take(self, at_us: int, bits: int) -> Window | None:
        """Count a frame.

        Returns:
            The window that its time has ended, if any.
        """
        self._bits += bits
        begin_us, before = self._open
        if at_us < begin_us + WINDOW_US:
            self._open = Window(begin_us, before + bits)
            return None
        ended = self._ended = self._open
        self._peak = busier(self._peak, ended)
        self._open = Window(window_begin(self._first_us, at_us), bits)
        return ended

    def end(self) -> Window:
        """Return the window that is open."""
        return self._open

    def row(self, now_us: int) -> LoadRow:
        """Return how busy the bus was until now."""
        windows = (self._open.at_us - self._first_us) // WINDOW_US + 1
        return LoadRow(
            self._bits,
            self._latest(now_us),
            busier(self._peak, self._open),
            self._bits * 1_000_000 // (windows * WINDOW_US),
        )

    def _latest(self, now_us: int) -> Window:
        begin_us = window_begin(self._first_us, now_us) - WINDOW_US
        if begin_us < self._first_us:
            return self._open
        kept = (window for window in (self._open, self._ended) if window.at_us == begin_us)
        return next(kept, Window(begin_us, 0))


def window_begin(first_us: int, at_us: int) -> int:
    """Return the begin of the window of a time."""
    return at_us - (at_us - first_us) % WINDOW_US


def busier(first: Window, second: Window) -> Window:
    """Return the window with more bits, the first if they have the same."""
    return second if second.bits > first.bits else first
