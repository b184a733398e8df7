"""Violations of the rhythm of frames that are sent repeatedly."""

# Theory of operation
# ===================
#
# The period of an identifier is not given: it is learnt from all of its frames at once, and a
# source without a rhythm must give no finding. So the gaps are evaluated in windows of eight. The
# median of a window is the period there, the distance of its quartiles the spread; one or two odd
# gaps affect neither. Three kinds of windows follow:
#
#     steady   the quartiles are close: the median is a period
#     noisy    they are not
#
# A run of steady windows with the same median is a level. Most windows on one level: that is the
# period, and deviations from it are judged. Few levels that follow each other: the period changed.
# Neither: frames come with events, and there is no finding.
#
# On a level a gap of about two periods is a missing frame, unless the next gap compensates it: then
# the frame was late. A short gap whose neighbour fills it up to one period has a frame too many
# between two that are right; a short gap before a whole period is an event that restarts the event
# timer of a transmission, which is correct.
#
# Noisy windows that stand together in a log whose other windows are quiet are a jitter that
# changed; noisy windows all over the log are normal for the source.

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tickrig._lazy import LazyModule

if TYPE_CHECKING:
    import numpy as np
else:  # an extra
    np = LazyModule("numpy")

_WINDOW: Final = 8
LEAST_GAPS: Final = 6
"""Number of gaps from which a period is known."""

_SHORTEST_US: Final = 900
"""Shortest period. Shorter ones are bursts, or too short for the clocks of loggers."""
_FLOOR_US: Final = 700
"""Error of the time stamps of loggers, whatever the source does."""
_CALM: Final = 0.12
"""Relative spread of gaps above which frames have no rhythm that can be judged."""
_STEADY: Final = 0.15
_SAME: Final = 0.12
_NEAR: Final = 0.2
_ON_LEVEL: Final = 0.6
_MOST_LEVELS: Final = 5
_MOST_ODD: Final = 0.12
"""Share of odd gaps above which such gaps are normal for the source."""
_LOST: Final = 1.65
_NOISY: Final = 0.08
_TIMES_NOISIER: Final = 4
_LEAST_NOISY: Final = 2
_LEAST_QUIET: Final = 0.3
_LEAST_AT_ONCE: Final = 64
_FEW_RUNS: Final = 64
"""Number of runs above which a search window by window is faster."""


class _Level(NamedTuple):
    """A series of gaps with one period.

    Attributes:
        begin: index of the first gap.
        end: index after the last gap.
        period_us: period of the gaps.
    """

    begin: int
    end: int
    period_us: int


class Rhythm(NamedTuple):
    """The rhythm of a CAN-ID that is sent periodically, and all deviations from its period.

    A gap is the time between two successive frames.

    Attributes:
        levels: parts of the log with one period each, in order. There are several if the period
            changed.
        missing: gaps in which frames are missing, each as the index of the gap and the number of
            missing frames.
        extra: indices of surplus frames, which lie between two frames that keep the period.
        noisy: parts with large jitter, each as the index of its first gap, the index of its last
            gap, the usual jitter in us, and the large jitter in us.
        spread_us: usual jitter in us, as interquartile range of the gaps outside of the noisy
            parts.
        share: fraction of the gaps that have the main period, from 0 to 1.
    """

    levels: tuple[_Level, ...]
    missing: tuple[tuple[int, int], ...] = ()
    extra: tuple[int, ...] = ()
    noisy: tuple[tuple[int, int, int, int], ...] = ()
    spread_us: int = 0
    share: float = 1.0

    @property
    def period_us(self) -> int:
        """The period of most gaps."""
        return max(self.levels, key=lambda one: one.end - one.begin).period_us


def rhythm_of(times: Sequence[int]) -> Rhythm | None:
    """Return the period of a CAN-ID's frames and the deviations from it, or None without a period.

    Args:
        times: times of the frames in microseconds, in order.

    >>> rhythm_of([0, 10_000, 20_000, 30_000, 50_000, 60_000, 70_000, 80_000]).missing
    ((3, 1),)
    """
    if len(times) <= LEAST_GAPS:
        return None
    gaps = _gaps_of(times)
    windows = _windows(gaps)
    count = len(windows.middles)
    period_us = _ranked(windows.middles, count // 2)
    usual = _ranked(windows.spreads, count // 4)
    if period_us < _SHORTEST_US or usual > max(_CALM * period_us, min(_FLOOR_US, period_us / 4)):
        return None
    levels = _levels(windows, len(gaps), usual)
    if not 0 < len(levels) <= _MOST_LEVELS:
        return None
    main = max(levels, key=lambda one: one.end - one.begin).period_us
    spreads = windows.spreads_of(main, usual)
    quiet = _ranked(spreads, len(spreads) // 4) if len(spreads) else usual
    noisy = _noisy(windows, gaps, main, quiet) if len(levels) == 1 else []
    covered = sum(one.end - one.begin for one in levels)
    if covered + sum(end - begin for begin, end, _, _ in noisy) < _ON_LEVEL * len(gaps):
        return None
    missing: list[tuple[int, int]] = []
    extra: list[int] = []
    for place, level in enumerate(levels):
        # At a change of the period, a window belongs to both periods.
        inner = level._replace(
            begin=level.begin + _WINDOW * (place > 0),
            end=level.end - _WINDOW * (place < len(levels) - 1),
        )
        lost, doubled, events = _odd(gaps, inner, quiet)
        most = max(3, _MOST_ODD * (level.end - level.begin))
        missing += lost if len(lost) <= most else []
        extra += doubled if len(doubled) <= most and events <= len(doubled) + 2 else []
    off = max(_NEAR * main, 4 * quiet)
    share = 1 - len(_outside(gaps, 0, len(gaps), main - off, main + off)) / len(gaps)
    return Rhythm(tuple(levels), tuple(missing), tuple(extra), tuple(noisy), quiet, share)


def _gaps_of(times: Sequence[int]) -> Sequence[int]:
    """Return the gaps between times. For an array of numpy, the gaps are an array."""
    if isinstance(times, list):
        return [b - a for a, b in pairwise(times)]
    found: Any = np.diff(np.asarray(times))  # an array is a sequence for all that is done here
    return found  # type: ignore[no-any-return]


class _Windows(NamedTuple):
    """Windows of eight gaps each, as lists or arrays of numpy.

    Attributes:
        middles: median of each window.
        spreads: distance of the quartiles of each window.
    """

    middles: Sequence[int]
    spreads: Sequence[int]

    def spreads_of(self, period_us: int, usual: int) -> Sequence[int]:
        """Return the spreads of the windows whose period is about the given one."""
        if not isinstance(self.middles, list):
            spreads: Any = self.spreads
            return spreads[_are_alike(self.middles, period_us, usual)]  # type: ignore[no-any-return]
        pairs = zip(self.middles, self.spreads, strict=True)
        return [spread for middle, spread in pairs if _alike(middle, period_us, usual)]

    def above(self, limit: float) -> list[int]:
        """Return the windows with a larger spread."""
        if isinstance(self.spreads, list):
            return [at for at, spread in enumerate(self.spreads) if spread > limit]
        found: list[int] = np.flatnonzero(np.asarray(self.spreads) > limit).tolist()
        return found


def _windows(gaps: Sequence[int]) -> _Windows:
    """Return the median and the distance of the quartiles of each window of eight gaps."""
    size = min(_WINDOW, len(gaps))
    low, middle, high = size // 4, size // 2, (3 * size) // 4
    if isinstance(gaps, list):
        cut = [sorted(gaps[at : at + size]) for at in range(0, len(gaps) - size + 1, size)]
        return _Windows([one[middle] for one in cut], [one[high] - one[low] for one in cut])
    whole = len(gaps) // size
    table: Any = np.sort(np.asarray(gaps[: whole * size]).reshape(whole, size), axis=1)
    return _Windows(table[:, middle].copy(), table[:, high] - table[:, low])


def _ranked(values: Sequence[int], place: int) -> int:
    """Return the value at a position in sorted order."""
    if isinstance(values, list):
        return int(sorted(values)[place])
    return int(np.partition(np.asarray(values), place)[place])


def _alike(one: float, other: float, usual: int) -> bool:
    """Return whether two periods are the same, given the usual spread of gaps."""
    return abs(one - other) <= max(_SAME * max(one, other), min(_FLOOR_US, other / 4), 2 * usual)


def _are_alike(periods: Any, other: float, usual: int) -> Any:
    """Return the result of `_alike` for each period of an array."""
    least = max(min(_FLOOR_US, other / 4), 2 * usual)
    return np.abs(periods - other) <= np.maximum(_SAME * np.maximum(periods, other), least)


def _is_steady(middle: int, spread: int) -> bool:
    limit = max(_STEADY * middle, min(_FLOOR_US, middle / 3))
    return middle >= _SHORTEST_US and spread <= limit


def _runs(windows: _Windows, usual: int) -> list[list[int]]:
    """Return runs of steady windows with one median. Noisy windows with this median join a run.

    Each run is a tuple of its first window, the window after its last window, and its median.
    """
    runs: list[list[int]] = []
    begin = 0 if isinstance(windows.middles, list) else _array_runs(windows, usual, runs)
    pairs = zip(windows.middles[begin:], windows.spreads[begin:], strict=True)
    for at, (middle, spread) in enumerate(pairs, begin):
        same = bool(runs) and _alike(middle, runs[-1][2], usual)
        if same and (_is_steady(middle, spread) or at - runs[-1][1] < 1):
            runs[-1][1] = at + 1
        elif not same and _is_steady(middle, spread):
            runs.append([at, at + 1, int(middle)])
    return runs


def _array_runs(windows: _Windows, usual: int, runs: list[list[int]]) -> int:
    """Find runs in arrays as long as there are few runs. Return the next window."""
    middles, spreads = np.asarray(windows.middles), np.asarray(windows.spreads)
    limits = np.maximum(_STEADY * middles, np.minimum(_FLOOR_US, middles / 3))
    steady = (middles >= _SHORTEST_US) & (spreads <= limits)
    begin, size = int(np.argmax(steady)), _LEAST_AT_ONCE
    if not steady[begin]:
        return len(middles)
    runs.append([begin, begin + 1, int(middles[begin])])
    begin += 1
    while begin < len(middles) and len(runs) < _FEW_RUNS:
        run, end = runs[-1], min(begin + size, len(middles))
        same = _are_alike(middles[begin:end], run[2], usual)
        others = np.flatnonzero(~same & steady[begin:end])
        if len(others):
            end = begin + int(others[0])
            same = same[: end - begin]
        belong = np.flatnonzero(same & steady[begin:end])
        if len(belong):
            run[1] = begin + int(belong[-1]) + 1
        if begin <= run[1] < end:  # noisy ones right behind it
            strange = np.flatnonzero(~same[run[1] - begin :])
            run[1] = run[1] + int(strange[0]) if len(strange) else end
        begin, size = end, 4 * size
        if len(others):
            runs.append([end, end + 1, int(middles[end])])
            begin, size = end + 1, _LEAST_AT_ONCE
    return begin


def _levels(windows: _Windows, gaps: int, usual: int) -> list[_Level]:
    """Return the runs of windows that are not a disturbance."""
    runs, count = _runs(windows, usual), len(windows.middles)
    # A single window between two of the same period is a disturbance, and no level.
    joined: list[list[int]] = []
    for run in runs:
        lone = run[1] - run[0] < 2 and count > 2
        if joined and _alike(run[2], joined[-1][2], usual):
            joined[-1][1] = run[1]
        elif not lone:
            joined.append(run)
    size = min(_WINDOW, gaps)
    levels = []
    for begin, end, _ in joined:
        middle = _ranked(windows.middles[begin:end], (end - begin) // 2)
        levels.append(_Level(begin * size, end * size, middle))
    if levels and levels[-1].end + size > gaps:
        levels[-1] = levels[-1]._replace(end=gaps)
    return levels


def _odd(
    gaps: Sequence[int], level: _Level, quiet: int
) -> tuple[list[tuple[int, int]], list[int], int]:
    """Judge the gaps of a level that differ from its period.

    Returns:
        The gaps in which frames are missing, the surplus frames, and the number of frames that
        events triggered.
    """
    period = level.period_us
    off = max(_NEAR * period, 4 * quiet, min(_FLOOR_US, period / 3))
    missing: list[tuple[int, int]] = []
    extra: list[int] = []
    events, taken = 0, -1
    for at in _outside(gaps, level.begin, level.end, period - off, period + off):
        if at <= taken:
            continue
        around = [int(gap) for gap in gaps[at : at + 3]]
        if around[0] > period + off:
            made_up = any(
                len(around) > more
                and min(around[1 : more + 1]) < period - off
                and abs(sum(around[: more + 1]) - (more + 1) * period) <= off
                for more in (1, 2)
            )
            if made_up:
                taken = at + 2
            elif around[0] > _LOST * period:
                missing.append((at, max(1, round(around[0] / period) - 1)))
        elif len(around) > 1 and abs(around[0] + around[1] - period) <= off / 2:
            extra.append(at + 1)
            taken = at + 1
        elif at and abs(int(gaps[at - 1]) + around[0] - 2 * period) <= off / 2:
            continue  # the frame before was late
        elif len(around) < 2 or around[1] <= period + off:
            events += 1
        else:  # too early by what the next gap is longer
            taken = at + 1
    return missing, extra, events


def _outside(gaps: Sequence[int], begin: int, end: int, low: float, high: float) -> list[int]:
    """Return the positions of gaps that are shorter or longer than the period."""
    if isinstance(gaps, list):
        return [at for at in range(begin, end) if not low <= gaps[at] <= high]
    part = np.asarray(gaps[begin:end])
    found: list[int] = (np.flatnonzero((part < low) | (part > high)) + begin).tolist()
    return found


def _noisy(
    windows: _Windows, gaps: Sequence[int], period: int, quiet: int
) -> list[tuple[int, int, int, int]]:
    """Return the runs of windows with a large jitter, if the other windows are quiet."""
    limit = max(_NOISY * period, 500, _TIMES_NOISIER * quiet)
    loud, count = windows.above(limit), len(windows.spreads)
    still = count - len(windows.above(max(limit / 3, 2 * quiet)))
    if still < _LEAST_QUIET * count or not loud:
        return []
    runs: list[list[int]] = []  # first window, one behind the last, how many are loud
    for at in loud:
        if runs and at - runs[-1][1] <= 1:
            runs[-1][1:] = at + 1, runs[-1][2] + 1
        else:
            runs.append([at, at + 1, 1])
    long = [
        run
        for run in runs
        if run[1] - run[0] >= _LEAST_NOISY
        and _both_ways(gaps, run[0] * _WINDOW, run[1] * _WINDOW, period, limit)
    ]
    inside = sum(inner for _, _, inner in long)
    if not long or len(long) > 2 or inside < 0.7 * len(loud):
        return []
    return [
        (
            begin * _WINDOW,
            end * _WINDOW,
            quiet,
            _ranked(windows.spreads[begin:end], (end - begin) // 2),
        )
        for begin, end, _ in long
    ]


def _both_ways(gaps: Sequence[int], begin: int, end: int, period: int, limit: float) -> bool:
    """Return whether gaps are longer as often as shorter. Events make gaps only shorter."""
    part = [int(gap) for gap in gaps[begin:end]]
    longer = sum(gap > period + limit / 3 for gap in part)
    shorter = sum(gap < period - limit / 3 for gap in part)
    return 3 * longer >= shorter
