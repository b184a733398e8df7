"""The frames of a check, as `canmon dump` shows them.

>>> from tickrig.host.canopen.conform.verdict import Direction
>>> plain_frames([Line(1_250, Direction.SENT, "605#40"), Line(2_000, Direction.REMARK, "?")])
[' (000.001250)  >  605   [1]  40', ' (000.002000)  #  ?']
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tickrig.host.canopen.conform.verdict import Direction, Line, Outcome
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import CanFrame
from tickrig.wire.errors import WireError

ShowFrames = Callable[[Sequence[Line]], list[str]]
"""Writes the lines of a check, one each, for people."""


DATA_WIDTH: Final = len("[8]  00 11 22 33 44 55 66 77")


def plain_frames(lines: Sequence[Line]) -> list[str]:
    """Write lines with their bytes alone."""
    return [plain_frame(line) for line in lines]


def plain_frame(line: Line, meaning: str = "") -> str:
    """Write a line.

    Args:
        line: a frame, or a remark.
        meaning: what stands behind a frame; empty where nobody knows.
    """
    seconds, micros = divmod(line.at_us, 1_000_000)
    head = f" ({seconds:03}.{micros:06})  {line.direction}  "
    if line.direction is Direction.REMARK or (frame := frame_of(line)) is None:
        return head + one_line(line.text)
    ident = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
    data = f" {frame.data.hex(' ').upper()}" if frame.data else ""
    text = " remote request" if frame.remote else data
    shown = f"[{frame.remote_length if frame.remote else len(frame.data)}] {text}".rstrip()
    behind = f"{shown:<{DATA_WIDTH}}   {one_line(meaning)}" if meaning else shown
    return f"{head}{ident}   {behind}"


def frame_of(line: Line) -> CanFrame | None:
    """Return the frame of a line; None if it is none."""
    try:
        return CanFrame.parse(line.text)
    except (ValueError, WireError):
        return None


def cut(lines: list[str], most: int) -> list[str]:
    """Return the first and the last lines where there are more than `most`, and how many are not.

    >>> cut(["a", "b", "c", "d", "e"], 3)
    ['a', '... 3 more lines ...', 'e']
    """
    if len(lines) <= most:
        return lines
    head, tail = most // 2, most - most // 2 - 1
    left_out = f"... {len(lines) - head - tail} more lines ..."
    return [*lines[:head], left_out, *lines[len(lines) - tail :]]


def all_goes(outcome: Outcome, first: Outcome | None, show: ShowFrames) -> list[str]:
    """Return the lines of a check, those of its first go before them if they differ."""
    if first is None:
        return show(outcome.evidence)
    if same_go(first, outcome):
        return [SAME, *show(outcome.evidence)]
    again = f"first: {first.verdict}" + (f": {one_line(first.reason)}" if first.reason else "")
    return [again, *show(first.evidence), "and again:", *show(outcome.evidence)]


SAME: Final = "first: the same"


def same_go(first: Outcome, again: Outcome) -> bool:
    """Say whether two goes differ in nothing but their times."""
    one, other = ([line[1:] for line in each.evidence] for each in (first, again))
    return (first.verdict, first.reason, one) == (again.verdict, again.reason, other)
