"""Sequences as plain lines: `+ms id#data`, and how often all of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from typing import Final

from tickrig.host.monitor.sequence.steps import FOREVER, Place, Repeat, Send, Sequence, Step, Wait
from tickrig.wire.can import CanFrame
from tickrig.wire.errors import WireError

_COMMENT: Final = re.compile(r"(^|\s)#.*")
_LOOP: Final = re.compile(r"loop\s+([0-9]{1,9}|forever)")
_FRAME: Final = re.compile(r"\+([0-9]{1,9}(?:\.[0-9]{1,3})?)\s+(\S+)")


class SequenceError(ValueError):
    """A sequence that cannot be carried out; its text says where and why."""


def parse_lines(text: str, file: str) -> Sequence:
    """Read a sequence of lines.

    `+10 123#DEADBEEF` sends a frame 10 ms after the line above; `loop 3` as the first line does
    all of it three times, `loop forever` until it is stopped; `#` begins a comment.

    Raises:
        SequenceError: `FILE:LINE: what came, what is allowed`.
    """
    steps: list[Step] = []
    times = 1
    for number, content in _contents(text):
        try:
            if loop := _LOOP.fullmatch(content):
                times = _times(loop[1], first=not steps)
            else:
                steps += _line(content, number)
        except (ValueError, WireError) as error:
            raise SequenceError(f"{file}:{number}: {error}") from None
    if not steps:
        raise SequenceError(f"{file}:1: no frame, as '+10 123#DEADBEEF'")
    if times == FOREVER and not any(isinstance(step, Wait) and step.wait_us for step in steps):
        raise SequenceError(f"{file}:1: loop forever takes no time: write +10 before a frame")
    return Sequence((Repeat((1,), times, tuple(steps)),), partial(_place, file))


def _contents(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), 1):
        if content := _COMMENT.sub("", line).strip():
            yield number, content


def _times(word: str, *, first: bool) -> int:
    if not first:
        raise ValueError("loop stands before the first frame")
    if word == "forever":
        return FOREVER
    if not (times := int(word)):
        raise ValueError("loop takes 1 or more, or forever; got 0")
    return times


def _line(content: str, number: int) -> list[Step]:
    match = _FRAME.fullmatch(content)
    if match is None:
        raise ValueError(f"{content!r} is not '+MS ID#DATA', as '+10 123#DEADBEEF', nor 'loop N'")
    frame = CanFrame.parse(match[2])
    return [Wait((number,), round(float(match[1]) * 1_000)), Send((number,), (frame,))]


def _place(file: str, place: Place) -> str:
    return f"{file}:{place[0]}"
