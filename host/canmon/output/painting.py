"""Taking what comes from a source, and showing it ten times a second."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, TypeVar

from tickrig.host.canmon.output.listening import POLL_US, is_over
from tickrig.host.canmon.output.screen import Screen
from tickrig.host.canmon.output.stopwatch import Stopwatch
from tickrig.host.canmon.sources.source import AnySource

if TYPE_CHECKING:
    from tickrig.host.monitor.decode.serial.heard_line import HeardLine
    from tickrig.host.monitor.frames.heard import Heard

PAINT_S: Final = 0.1
QUIT: Final = "q"

Item = TypeVar("Item", bound="Heard | HeardLine")
Lines = Callable[[int, int, int], list[str]]
"""Returns what is shown at a time on a screen with so many columns and lines."""


def paint(
    source: AnySource[Item],
    take: Callable[[Sequence[Item]], None],
    lines: Lines,
    span_us: int | None,
    press: Callable[[str], None] = lambda key: None,
) -> None:
    """Paint until q is pressed, the source ends or the time is over.

    Args:
        source: where frames come from; it is live.
        take: takes what comes.
        lines: what is shown.
        span_us: for how long; None for no end.
        press: acts on other keys, and what it does is shown at once.
    """
    watch, begin_s, due_s = Stopwatch(), time.monotonic(), 0.0
    with Screen() as screen:
        while not (source.ended or is_over(begin_s, span_us)):
            heards = source.poll(POLL_US)
            take(heards)
            watch.take(heards)
            keys = screen.keys()
            if QUIT in keys:
                break
            for key in keys:
                press(key)
            if keys or time.monotonic() >= due_s:
                due_s = time.monotonic() + PAINT_S
                screen.paint(lines(watch.now_us, *screen.size()))
