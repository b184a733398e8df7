"""A sequence as it is carried out, and what it waits for: frames by a pattern or a filter.

>>> from tickrig.wire.can import CanFrame
>>> frames = map(CanFrame.parse, ("585#6041", "585#60F1AA", "585#6042"))
>>> [parse_pattern("585#60?1*").matches(Record(0, "can0", frame)) for frame in frames]
[True, True, False]
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.text.steps import Condition, Place, Step
from tickrig.host.text.values import format_time
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f?]{3}|[0-9A-Fa-f?]{8})#(R[0-8]?|(?:[0-9A-Fa-f?]{2}\.?){0,8}\*?)"
)


FrameCondition = Condition[Record]


def parse_pattern(text: str) -> FrameCondition:
    """Read a frame in candump notation, with `?` for any hex digit and `*` for any more bytes.

    Raises:
        ValueError: it is none.
    """
    match = _NOTATION.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"{text!r} is not a frame like 705#05, 585#60??????* or 705#R")
    can_id, data = (part.upper().replace(".", "") for part in match.groups())
    body = data.replace("?", "[0-9A-F]").replace("*", "[0-9A-F]*")
    regex = re.compile(f"{can_id.replace('?', '[0-9A-F]')}#{body}")
    return Condition(text, lambda record: regex.fullmatch(str(record.frame)) is not None)


class DecodedCondition:
    """Keeps the latest frame with its meaning, for the conditions of a sequence."""

    def __init__(self) -> None:
        self._latest: tuple[Record, Decoded] | None = None

    def take(self, record: Record, decoded: Decoded) -> None:
        """Take a frame; conditions are asked about it next."""
        self._latest = record, decoded

    def condition(self, text: str) -> FrameCondition:
        """Return the condition of a filter expression; ValueError if it is none."""
        chosen = parse_filter(text)

        def matches(record: Record) -> bool:
            latest = self._latest
            return latest is not None and latest[0] is record and chosen.matches(*latest)

        return Condition(text, matches)


FrameStep = Step[Frames, Record]
"""Sends frames, waits, expects frames, or repeats other steps."""


@dataclass(frozen=True, slots=True)
class Sequence:
    """Steps, and how a place in them is told.

    Attributes:
        steps: in their order.
        locate: returns `FILE:LINE` of a place.
    """

    steps: tuple[FrameStep, ...]
    locate: Callable[[Place], str]


class EventType(StrEnum):
    """What a note is about."""

    SENT = ">"
    MET = "ok"
    MISSED = "?"
    END = "."


class SequenceEvent(NamedTuple):
    """What happened when."""

    at_us: int
    mark: EventType
    text: str


class _Pause(NamedTuple):
    until_us: int
    conditions: tuple[FrameCondition, ...] = ()


_Play = Generator[_Pause, bool, bool]
"""Yields pauses, is sent whether they were met, and returns whether to carry on."""


class SequenceRun:
    """Carries out a sequence as time passes.

    Waits are counted from when the step before was due, so they do not drift. Frames that one
    call brings are taken before its time runs out.

    Args:
        sequence: what to do.

    Attributes:
        done: it has ended.
        met: how many expectations were met.
        missed: how many were not.
        events: what happened; whoever shows them may take them out.
    """

    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self._begun, self._at_us = False, 0
        self._play = self._all(sequence.steps)
        self._pause = _Pause(0)
        self._out: list[CanFrame] = []
        self.done = False
        self.met = self.missed = 0
        self.events: list[SequenceEvent] = []

    @property
    def due_us(self) -> int:
        """When it next wants to be called without a frame."""
        return self._pause.until_us

    def tick(self, now_us: int, records: Iterable[Record] = ()) -> Frames:
        """Take in what was heard, carry out what is due, and return what to send.

        Args:
            now_us: the time; the first call begins the sequence.
            records: frames since the last call; those that this program sent are passed over.
        """
        if not self._begun:
            self._begun, self._at_us = True, now_us
            self._resume(now_us, None)
        for one in records:
            if self._pause.conditions and not one.sent:
                self._receive(one, now_us)
        while self.due_us <= now_us:
            self._resume(self._pause.until_us, not self._pause.conditions)
        out, self._out = tuple(self._out), []
        return out

    def _receive(self, record: Record, now_us: int) -> None:
        conditions = self._pause.conditions
        for number, condition in enumerate(conditions):
            if condition.matches(record):
                left = conditions[:number] + conditions[number + 1 :]
                self._pause = _Pause(self._pause.until_us, left)
                if not left:
                    self._resume(now_us, True)
                return

    def _resume(self, at_us: int, met: bool | None) -> None:
        """Carry on at a time up to the next pause; None begins."""
        self._at_us = at_us
        try:
            self._pause = next(self._play) if met is None else self._play.send(met)
        except StopIteration:
            self.done, self._pause = True, _Pause(NEVER)
            self._report(EventType.END, f"{self.met} met, {self.missed} missed")

    def _all(self, steps: tuple[FrameStep, ...]) -> _Play:
        for step in steps:
            if not (yield from self._one(step)):
                return False
        return True

    def _one(self, step: FrameStep) -> _Play:
        if step.at_us is not None:
            yield _Pause(self._at_us + step.at_us)
        self._send(step.what or ())
        if step.wanted:
            return (yield from self._expect(step))
        count = 0
        while step.steps and (not step.times or count < step.times):
            if not (yield from self._all(step.steps)):
                return False
            count += 1
        return True

    def _send(self, frames: Frames) -> None:
        self._out += frames
        for frame in frames:
            self._report(EventType.SENT, str(frame))

    def _expect(self, step: FrameStep) -> _Play:
        wanted = " and ".join(condition.text for condition in step.wanted)
        if (yield _Pause(self._at_us + step.within_us, step.wanted)):
            self.met += 1
            self._report(EventType.MET, wanted)
            return True
        self.missed += 1
        missing = " and ".join(condition.text for condition in self._pause.conditions)
        place = self._sequence.locate(step.place)
        self._report(
            EventType.MISSED, f"{place}: no {missing} within {step.within_us / 1_000:g} ms"
        )
        return (yield from self._all(step.on_fail)) and step.goes_on

    def _report(self, mark: EventType, text: str) -> None:
        self.events.append(SequenceEvent(self._at_us, mark, text))


def event_line(event: SequenceEvent) -> str:
    """Write a note: seconds, mark, and what happened.

    >>> from tickrig.host.canmon.model.sequence.sequence_run import EventType
    >>> event_line(SequenceEvent(4_718, EventType.MET, "703#05"))
    '0.004718 ok 703#05'
    """
    return f"{format_time(event.at_us)} {event.mark} {event.text}"


def outline(steps: tuple[FrameStep, ...], depth: int = 0) -> list[str]:
    """Return the steps as lines for people, indented where they are repeated."""
    lines = []
    for step in steps:
        lines += ["  " * depth + text for text in _texts(step)]
        lines += outline(step.steps or step.on_fail, depth + 1)
    return lines


def _texts(step: FrameStep) -> Iterator[str]:
    if step.at_us is not None:
        yield f"wait {step.at_us / 1_000:g} ms"
    if step.what:
        yield "send " + " ".join(map(str, step.what))
    if step.wanted:
        wanted = " and ".join(condition.text for condition in step.wanted)
        then = "go on" if step.goes_on else "stop"
        yield f"expect {wanted} within {step.within_us / 1_000:g} ms, else {then}"
    if step.times is not None:
        yield f"repeat {step.times or 'forever'}"
