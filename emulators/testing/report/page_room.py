"""Which parts of which tests have room on a page: a browser has to open it in a few seconds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final

from markupsafe import escape

from tickrig.emulators.testing.report.bench_report import Outcome, TestRecord
from tickrig.emulators.testing.report.timeline import Timeline

PAGE_BYTES: Final = 16_000_000
"""For what tests bring; what stands around it comes on top."""

JOURNAL_LINES: Final = 200
LINE_CHARACTERS: Final = 2_000
TEXT_BYTES: Final = 64_000
"""Of what pytest tells about a failure."""
TRACE_BYTES: Final = 256_000
LINE_BYTES: Final = 48
"""What a line of a journal has around its text."""


class Part(Enum):
    """A part of a test, in the order in which parts are given room."""

    TEXT = auto()
    TIMELINE = auto()
    JOURNAL = auto()
    TRACE = auto()


@dataclass(slots=True)
class PageRoom:
    """Gives room to what matters most: of each part, first that of failed tests.

    Args:
        tests: all tests.
        timelines: theirs.
        room_bytes: how much there is.

    Attributes:
        admitted: number of the test and part, of all that have room.
    """

    tests: Sequence[TestRecord]
    timelines: Sequence[Timeline | None]
    room_bytes: int = PAGE_BYTES
    admitted: set[tuple[int, Part]] = field(init=False, default_factory=set)

    def __post_init__(self) -> None:
        """Share the room."""
        order = list(Outcome)
        first = sorted(range(len(self.tests)), key=lambda n: order.index(self.tests[n].outcome))
        for part in Part:
            for number in first:
                size = self._size(number, part)
                if size <= self.room_bytes:
                    self.admitted.add((number, part))
                    self.room_bytes -= size

    def _size(self, number: int, part: Part) -> int:
        test, timeline = self.tests[number], self.timelines[number]
        match part:
            case Part.TEXT:
                return size_of(test.longrepr[:TEXT_BYTES])
            case Part.TIMELINE:
                return timeline.size if timeline else 0
            case Part.JOURNAL:
                return size_of("".join(journal_texts(test)))
            case Part.TRACE:
                return size_of(cut(test.trace, TRACE_BYTES)[0])


def journal_texts(test: TestRecord) -> Iterator[str]:
    """Yield the texts of the lines that are shown, each with room for what is around it."""
    for line in test.journal[-JOURNAL_LINES:]:
        yield line.text[:LINE_CHARACTERS] + " " * LINE_BYTES


def size_of(text: str) -> int:
    """Return how many bytes a text takes on a page."""
    return len(str(escape(text)).encode("utf-8", "replace"))


def cut(text: str, most: int) -> tuple[str, int]:
    """Return whole lines of at most so many characters from the beginning, and how many are cut."""
    if len(text) <= most:
        return text, 0
    end = text.rfind("\n", 0, most) + 1 or most
    return text[:end], len(text) - end
