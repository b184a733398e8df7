"""Demands on how often something comes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Final

from tickrig.host.canmon.model.check.expression.demand import Demand
from tickrig.host.canmon.model.check.expression.event import Event, Sender, said, sender_of
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames.quantity import ms_text
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.text.values import counted

MOST_COUNTED: Final = 10_000
"""So many frames of a time may be allowed: their times are kept."""


class Truth(Demand):
    """A condition on signals never holds, or always.

    It is told when it begins to be wrong, not with each frame.

    Args:
        event: the condition.
        wanted: what it must be.
    """

    def __init__(self, event: Event, wanted: bool) -> None:
        self._matches, self._carries, self._wanted = event.matches, event.carriers(), wanted
        self._wrong: set[Sender] = set()
        self.doubt = f"nothing with {event.text} came while it was in force"

    def pause(self) -> None:
        """Tell it again."""
        self._wrong.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the condition."""
        if not self._carries(decoded):
            return None
        self.judged = True
        sender = sender_of(record)
        if self._matches(record, decoded) is self._wanted:
            self._wrong.discard(sender)
        elif sender not in self._wrong:
            self._wrong.add(sender)
            return said(decoded)
        return None


class Never(Demand):
    """No such frame comes; each one is told.

    Args:
        event: the frames.
    """

    def __init__(self, event: Event) -> None:
        self._matches = event.matches

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Tell it."""
        self.judged = True
        return said(decoded) if self._matches(record, decoded) else None


class Count(Demand):
    """So many frames come.

    Args:
        event: the frames.
        least: at least so many; told at the end.
        most: at most so many; what comes too much is told, once. None for any number.
    """

    def __init__(self, event: Event, least: int, most: int | None) -> None:
        self._event, self._least, self._most, self._count = event, least, most, 0

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Count a frame."""
        self.judged = True
        if not self._event.matches(record, decoded):
            return None
        self._count, self.came = self._count + 1, True
        if self._most is None or self._count != self._most + 1:
            return None
        return (
            f"{self._event.text} came {counted(self._count, 'time')}, at most {self._most} is right"
        )

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Say that too few came."""
        if self._count < self._least:
            came = f"{self._event.text} came {counted(self._count, 'time')}"
            yield f"{came}, at least {self._least} is right"


class Rate(Demand):
    """At most so many frames come in any span of time.

    Args:
        event: the frames.
        most: how many, up to `MOST_COUNTED`.
        span_us: the span.
    """

    timed = True

    def __init__(self, event: Event, most: int, span_us: int) -> None:
        self._event, self._most, self._span_us = event, most, span_us
        self._times_us: deque[int] = deque(maxlen=most + 1)

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Look how long ago the frame was that must be out of the span; then count anew."""
        self.judged = True
        if not self._event.matches(record, decoded):
            return None
        times_us = self._times_us
        times_us.append(record.at_us)
        took_us = record.at_us - times_us[0]
        if len(times_us) <= self._most or took_us >= self._span_us:
            return None
        came = f"{self._event.text} came {counted(len(times_us), 'time')} in {ms_text(took_us)} ms"
        times_us.clear()
        return f"{came}, at most {self._most} in {ms_text(self._span_us)} is right"
