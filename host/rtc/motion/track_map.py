"""A map of a cart's track in braille letters, once or again and again in one place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tickrig.host.canmon.model.graph.plot import DOTS_X, DOTS_Y, Canvas
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.motion_run import Sample

WIDTH: Final = 60
HEIGHT: Final = 16
"""Cells."""
MARGIN: Final = 0.08
"""Share of the larger side that is left free all round."""
SMALLEST_M: Final = 0.5
DRAW_EVERY: Final = 10
"""Samples from one drawing to the next."""
_MARK: Final = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))


class TrackMap:
    """Goals and a track on as large a scale as they have room; x to the right, y up.

    Args:
        points: what must be on it.

    >>> track = TrackMap([Pose(), Pose(2.0, 1.0)], width=6, height=2)
    >>> for n in range(21):
    ...     track.add(Pose(n / 10, n / 20))
    >>> track.rows()
    ['   ⣀⠴⠗', '⢴⠖⠉⠁  ']
    """

    def __init__(self, points: Sequence[Pose], width: int = WIDTH, height: int = HEIGHT) -> None:
        xs, ys = [p.x for p in points], [p.y for p in points]
        columns, rows = width * DOTS_X - 1, height * DOTS_Y - 1
        spans = max(xs) - min(xs), max(ys) - min(ys)
        room = 1 - 2 * MARGIN
        self._scale = max(
            spans[0] / (columns * room), spans[1] / (rows * room), SMALLEST_M / columns
        )
        self._left = (max(xs) + min(xs)) / 2 - columns / 2 * self._scale
        self._top = (max(ys) + min(ys)) / 2 + rows / 2 * self._scale
        self._canvas = Canvas(width, height)
        for point in points:
            x, y = self._dot(point)
            for right, down in _MARK:
                self._set(x + right, y + down)

    def add(self, pose: Pose) -> None:
        """Mark where the cart is; nothing outside the map."""
        self._set(*self._dot(pose))

    def rows(self) -> list[str]:
        """Return the map, a text for each row of cells."""
        canvas = self._canvas
        return ["".join(text for text, _ in canvas.row(row)) for row in range(canvas.height)]

    def _dot(self, pose: Pose) -> tuple[int, int]:
        return round((pose.x - self._left) / self._scale), round((self._top - pose.y) / self._scale)

    def _set(self, x: int, y: int) -> None:
        if 0 <= x < self._canvas.width * DOTS_X:
            self._canvas.fill(x, y, y)


class LiveMap:
    """Receives each sample; draws the map and a line of numbers below it.

    Args:
        track: what is drawn.
        paint: writes what moves the cursor of a terminal, too.
    """

    def __init__(self, track: TrackMap, paint: Callable[[str], None]) -> None:
        self._track, self._paint = track, paint
        self._count = self._height = 0

    def watch(self, sample: Sample) -> None:
        """Take a sample; draw if it is time."""
        self._track.add(sample.pose)
        if self._count % DRAW_EVERY == 0:
            self._draw(sample)
        self._count += 1

    def _draw(self, sample: Sample) -> None:
        (x, y, heading), (v, w) = sample.pose, sample.twist
        numbers = f"{sample.time_s:7.2f} s  {x:+.3f} {y:+.3f} m  {heading:+.3f} rad"
        lines = [*self._track.rows(), f"{numbers}  {v:+.2f} m/s  {w:+.2f} rad/s"]
        up = f"\x1b[{self._height}A" if self._height else ""
        self._paint(up + "".join(f"{line}\x1b[K\n" for line in lines))
        self._height = len(lines)
