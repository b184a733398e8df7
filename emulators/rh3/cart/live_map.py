"""The map of a cart's track, drawn again and again in the same place of a terminal."""

from __future__ import annotations

from typing import Final, TextIO

from tickrig.emulators.rh3.cart.track_map import TrackMap
from tickrig.host.motion.motion_run import Sample

EVERY: Final = 10
"""Samples from one drawing to the next."""


class LiveMap:
    """Told each sample, it draws the map and a line of numbers below it.

    Args:
        track: what is drawn.
        out: a terminal.
    """

    def __init__(self, track: TrackMap, out: TextIO) -> None:
        self._track, self._out = track, out
        self._count = self._height = 0

    def watch(self, sample: Sample) -> None:
        """Take a sample; draw if it is time."""
        self._track.add(sample.pose)
        if self._count % EVERY == 0:
            self._draw(sample)
        self._count += 1

    def _draw(self, sample: Sample) -> None:
        (x, y, heading), (v, w) = sample.pose, sample.twist
        numbers = f"{sample.time_s:7.2f} s  {x:+.3f} {y:+.3f} m  {heading:+.3f} rad"
        lines = [*self._track.rows(), f"{numbers}  {v:+.2f} m/s  {w:+.2f} rad/s"]
        up = f"\x1b[{self._height}A" if self._height else ""
        self._out.write(up + "".join(f"{line}\x1b[K\n" for line in lines))
        self._out.flush()
        self._height = len(lines)
