"""Curves that go on, and which part of them is seen: driven by frames, keys and the time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from enum import StrEnum
from typing import Final, assert_never

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.chart import chart
from tickrig.host.canmon.model.graph.plot import render
from tickrig.host.canmon.model.graph.series import LEAST_US, Collector, Series, View
from tickrig.host.canmon.model.graph.signal_spec import CurveSpec

MOST: Final = 200_000
"""Samples of a signal that are kept."""

_WINDOW_US: Final = 10_000_000
_COLUMNS: Final = 200
"""In how many columns the range of an axis is looked for."""


class ViewMode(StrEnum):
    """What is seen."""

    LIVE = "live"  # a window that ends now
    ALL = "all"  # all samples
    HELD = "held"  # a span of time that stands still


class LiveGraph:
    """Takes the values of signals, and shows them.

    Args:
        mode: what is seen at first.

    Attributes:
        words: the signals.
        mode: what is seen.
        window_us: how long the window is that ends now.
        cursor_us: a moment that is read out, None for none.
        axis: the vertical axis that is stretched and moved.
        now_us: the time of the frames, as it was told last.
    """

    def __init__(self, mode: ViewMode = ViewMode.LIVE) -> None:
        self.words: list[CurveSpec] = []
        self.mode, self.window_us, self.axis = mode, _WINDOW_US, 1
        self.cursor_us: int | None = None
        self.now_us = 0
        self._collector = Collector((), None)
        self._ranges: dict[int, tuple[float, float]] = {}
        self._held, self._origin_us = View(0, _WINDOW_US), 0

    @property
    def series(self) -> list[Series]:
        """The samples of each signal."""
        return self._collector.series

    def add(self, word: CurveSpec, past: Iterable[tuple[Record, Decoded | None]] = ()) -> None:
        """Show one more signal; its values in frames of the past are taken, too."""
        fresh = Collector([word], None, MOST)
        for record, decoded in past:
            fresh.take_decoded(record, decoded)
        self._collector.join(fresh)
        self.words.append(word)

    def remove(self, number: int) -> None:
        """Show a signal no more."""
        self._collector.remove(number)
        del self.words[number]

    def take(self, record: Record, decoded: Decoded | None) -> None:
        """Take the values in a frame."""
        self._collector.take_decoded(record, decoded)

    def clear(self) -> None:
        """Forget all samples."""
        for series in self.series:
            series.clear()

    def view(self) -> View:
        """Return what is seen now."""
        whole = View.of(self.series)
        if not self._origin_us or whole.to_us < self._origin_us:
            self._origin_us = whole.origin_us
        match self.mode:
            case ViewMode.LIVE:
                view = View(self.now_us - self.window_us, self.now_us)
            case ViewMode.ALL:
                view = whole
            case ViewMode.HELD:
                view = self._held
            case _ as never:
                assert_never(never)
        return replace(
            view, ranges=self._ranges, cursor_us=self.cursor_us, origin_us=self._origin_us
        )

    def render(self, width: int, height: int) -> list[str]:
        """Return the picture as lines with ANSI colours."""
        return render(self.series, self.view(), width, height, colour=True)

    def show(self, mode: str) -> None:
        """See something else, without the cursor; `HELD` stops what is seen now."""
        self._held = self.view()
        self.mode, self.cursor_us = ViewMode(mode), None

    def zoom(self, factor: float) -> None:
        """Come closer by a factor: to the end of a live window, else to the cursor or middle."""
        if self.mode is ViewMode.LIVE:
            self.window_us = max(LEAST_US, round(self.window_us / factor))
            return
        self._hold(self.view().zoomed(factor, self.cursor_us))

    def move(self, fraction: float) -> None:
        """Move what is seen by a fraction of it, later for a positive one."""
        self._hold(self.view().moved(fraction))

    def move_cursor(self, fraction: float) -> None:
        """Move the cursor by a fraction of what is seen, which stops; it begins in the middle."""
        view = self.view()
        middle_us = (view.from_us + view.to_us) // 2
        at_us = middle_us if self.cursor_us is None else self.cursor_us
        at_us += round(view.span_us * fraction)
        self.cursor_us = min(max(at_us, view.from_us), view.to_us)
        self._hold(view)

    def next_axis(self) -> None:
        """Choose the next vertical axis that a signal has."""
        axes = sorted({word.axis for word in self.words}) or [1]
        self.axis = next((axis for axis in axes if axis > self.axis), axes[0])

    def stretch(self, factor: float) -> None:
        """Come closer to the middle of the axis by a factor."""
        low, high = self._range()
        middle, half = (low + high) / 2, (high - low) / 2 / factor
        self._set_range(middle - half, middle + half)

    def lift(self, fraction: float) -> None:
        """Move the axis by a fraction of its range, higher for a positive one."""
        low, high = self._range()
        by = (high - low) * fraction
        self._set_range(low + by, high + by)

    def fit(self) -> None:
        """Let the range of the axis be that of what is seen."""
        self._ranges.pop(self.axis, None)

    def _hold(self, view: View) -> None:
        self._held, self.mode = view, ViewMode.HELD

    def _range(self) -> tuple[float, float]:
        return chart(self.series, self.view(), _COLUMNS).ranges.get(self.axis, (0.0, 1.0))

    def _set_range(self, low: float, high: float) -> None:
        if low < high:  # floats have an end
            self._ranges = {**self._ranges, self.axis: (low, high)}
