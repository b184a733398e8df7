"""Times, tolerances and sets of values, as rules have them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Signal
from tickrig.host.canmon.model.decode.filter_terms import comparison, number
from tickrig.host.text.values import parse_time_us

_TIME: Final = re.compile(r"[0-9]{1,9}(?:\.[0-9]{1,9})?(?:s|ms|us)")
_SHARE: Final = re.compile(r"([0-9]{1,6}(?:\.[0-9]{1,6})?)%")


def time_us(text: str) -> int | None:
    """Read a time with its unit; None if it is none.

    >>> time_us("1.5ms"), time_us("2")
    (1500, None)
    """
    return parse_time_us(text) if _TIME.fullmatch(text) else None


def tolerance_us(text: str, period_us: int) -> int | None:
    """Read a share of a period, or a time; None if it is neither.

    >>> tolerance_us("10%", 10_000), tolerance_us("250us", 10_000)
    (1000, 250)
    """
    share = _SHARE.fullmatch(text)
    return int(period_us * float(share[1]) / 100) if share else time_us(text)


def values_of(parts: Sequence[tuple[str, ...]]) -> Callable[[Signal], bool]:
    """Return what says whether a signal has one of some values.

    Args:
        parts: a value each, or the ends of a range, of which one may be empty.

    Raises:
        ValueError: an end is no number, or the lower one is above the other.

    >>> holds = values_of([("7",), ("", "5")])
    >>> [holds(Signal("speed", value)) for value in (5, 6, 7)]
    [True, False, True]
    """
    tests = [comparison("=", part[0]) if len(part) == 1 else _within(*part) for part in parts]
    return lambda signal: any(test(signal) for test in tests)


def _within(low: str, high: str) -> Callable[[Signal], bool]:
    least, most = number(low or "-inf"), number(high or "inf")
    for text, end in ((low, least), (high, most)):
        if end is None or end != end:  # noqa: PLR0124 - what is no number
            raise ValueError(f"{text!r} is no number, as an end of a range is")
    assert least is not None
    assert most is not None
    if not (low or high) or least > most:
        raise ValueError(f"{low}..{high} is no range of values, as -5..5, 0.. or ..100")

    def holds(signal: Signal) -> bool:
        value = signal.value
        return isinstance(value, int | float) and least <= value <= most

    return holds
