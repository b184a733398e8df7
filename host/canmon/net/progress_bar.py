"""A line on a terminal that says how far a transfer is; none in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable

from tickrig.host.cli.start import paint

WIDTH = 30
LEAST_S = 1
S_US = 1_000_000


class ProgressBar:
    """Bytes done, of how many, and how fast.

    Args:
        total: bytes in all.
        now_us: tells the time of the bus.
    """

    def __init__(self, total: int, now_us: Callable[[], int]) -> None:
        self._total, self._now_us, self._begun_us = total, now_us, now_us()
        self._shown = sys.stderr.isatty()
        self._text = ""

    def take(self, done: int) -> None:
        """Show how many bytes are done."""
        if not done:
            self._begun_us = self._now_us()
        text = self._line(done)
        if self._shown and text != self._text:
            self._text = text
            paint(sys.stderr, f"\r\x1b[K{text}")

    def end(self) -> None:
        """Clear the line."""
        if self._shown:
            paint(sys.stderr, "\r\x1b[K")

    def _line(self, done: int) -> str:
        share = done / self._total if self._total else 1.0
        full = round(share * WIDTH)
        seconds = (self._now_us() - self._begun_us) / S_US
        line = f"[{'#' * full}{'.' * (WIDTH - full)}] {share:4.0%}  {done} of {self._total} bytes"
        if seconds < LEAST_S or not done:
            return line
        rate = done / seconds
        return f"{line}  {rate / 1_000:.1f} kB/s  {(self._total - done) / rate:.0f} s left"
