"""Keep what signals of a device were while a test ran."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tickrig.device.physical import OutputSignal
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.report.bench_report import SignalSeries
from tickrig.emulators.testing.report.thinning import Point, thinned

MOST: Final = 4_000
"""Samples of a signal that are kept; of more, every spike, but not every sample."""


class SignalSampler:
    """Takes the values of some signals; what stays as it is takes no room.

    Args:
        device: whose signals they are.
        names: of inputs and outputs; ValueError if there is none of a name.
        prefix: before each name in the series, such as `left_drive/`.
        most: how many samples of a signal are kept, at least 4.
    """

    def __init__(
        self, device: HasSignals, names: Iterable[str], prefix: str = "", most: int = MOST
    ) -> None:
        self._device, self._prefix, self._most = device, prefix, most
        self._points: dict[str, list[Point]] = {name: [] for name in names}
        self._latest: dict[str, Point] = {}
        for name in self._points:
            self._find(name)

    def take(self, now_us: int) -> None:
        """Look at the device: after each step (`Rig.watchers`), and once at the end.

        Args:
            now_us: the time, not before that of the last call.
        """
        for name, points in self._points.items():
            value = read_signal(self._device, name)
            before = self._latest.get(name)
            if before is None or before[1] != value:
                if before is not None and isinstance(value, float) and points[-1] != before:
                    points.append(before)  # a line goes on from here, not from the last change
                points.append((now_us, value))
                if len(points) > 2 * self._most:
                    points[:] = thinned(points, self._most)
            self._latest[name] = now_us, value

    def series(self) -> tuple[SignalSeries, ...]:
        """Return what was taken: numbers with a fraction as lines, all else as steps."""
        return tuple(self._series_of(name, points) for name, points in self._points.items())

    def _series_of(self, name: str, points: list[Point]) -> SignalSeries:
        kept = list(points)
        if kept and kept[-1] != self._latest[name]:
            kept.append(self._latest[name])
        kept = thinned(kept, self._most)
        steps = not any(isinstance(value, float) for _, value in kept)
        return SignalSeries(self._prefix + name, self._find(name), tuple(kept), steps)

    def _find(self, name: str) -> str:
        """Return the unit of a signal."""
        output: OutputSignal | None = self._device.outputs.get(name)
        return (output or self._device.inputs.find(name)).unit
