"""What something may wait for: a line or frame that passes, or any question about the bench."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.host.text.byte_text import escape

Condition = Callable[[], bool]
"""Says whether something is so; it only looks."""

ANY: Final = ""

ORDINALS: Final = {1: "st", 2: "nd", 3: "rd"}


class LineTrigger:
    """True from the moment at which a line or frame has passed so often.

    Args:
        pattern: the whole line, or the frame in candump's notation; `*` stands for anything.
        nth: the how manieth from now on, from 1.
        source: the wire or device; any if empty.

    Attributes:
        count: how many have passed.

    Raises:
        ValueError: `nth` is less than 1.
    """

    def __init__(self, pattern: str, nth: int = 1, source: str = ANY) -> None:
        if nth < 1:
            raise ValueError(f"nth counts from 1, got {nth}")
        self._text = pattern
        self._pattern = re.compile(".*".join(map(re.escape, pattern.split("*"))), re.DOTALL)
        self._nth, self._source, self.count = nth, source, 0

    def __call__(self) -> bool:
        """Say whether it has passed so often."""
        return self.count >= self._nth

    def __str__(self) -> str:
        """Say what it waits for.

        >>> str(LineTrigger("OK:*", nth=3))
        'the 3rd OK:*'
        """
        return f"the {_ordinal(self._nth)} {self._text}"

    def hear(self, line: WireLine) -> None:
        """Take a line of the journal."""
        if self._source in (ANY, line.source) and line.mark in "<>":
            self.count += self._pattern.fullmatch(escape(line.data)) is not None


def check_condition(condition: object) -> None:
    """Raise TypeError unless something can be asked again and again."""
    if not callable(condition):
        wanted = 'a function, as lambda: bench.get("state") == "Off", or bench.on_line("OK:*")'
        raise TypeError(f"{condition!r:.60} cannot be waited for: give {wanted}")


def text_of(condition: Condition) -> str:
    """Say what somebody waits for: a line, or where the question stands."""
    if isinstance(condition, LineTrigger):
        return str(condition)
    code = getattr(condition, "__code__", None)
    if code is None:
        return f"a {type(condition).__name__}"
    return f"the condition of {Path(code.co_filename).name}:{code.co_firstlineno}"


def _ordinal(number: int) -> str:
    """Write a number as people count.

    >>> [_ordinal(number) for number in (1, 2, 3, 4, 11, 22, 112)]
    ['1st', '2nd', '3rd', '4th', '11th', '22nd', '112th']
    """
    teens = number % 100 in (11, 12, 13)
    return f"{number}{'th' if teens else ORDINALS.get(number % 10, 'th')}"


def when(rig: BenchRig, condition: Condition, act: Callable[[], None]) -> None:
    """Act once, between two ticks, as soon as something is so: now, or after a later step."""

    def watch(now_us: int) -> None:
        if condition():
            rig.rig.watchers.remove(watch)
            act()

    rig.rig.watchers.append(watch)
    watch(rig.rig.now_us)
