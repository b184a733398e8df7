"""What happened in a test on one axis of time: faults, actions, physical values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.emulators.testing.report.axis import Axis, Span
from tickrig.emulators.testing.report.bench_report import JournalLine, PlannedFault, TestRecord
from tickrig.emulators.testing.report.lane import WORD_CHARACTERS, Lane, lane_of
from tickrig.host.text.values import counted

MOST_FAULTS: Final = 40
MOST_EVENTS: Final = 200
MOST_LANES: Final = 40
EVENT_CHARACTERS: Final = 200
ACTION: Final = "!"
MISS: Final = "?"


class Event(NamedTuple):
    """Something at a moment.

    Attributes:
        left: where, in per cent.
        text: what it was.
        missed: it was an expectation that was missed.
    """

    left: float
    text: str
    missed: bool


@dataclass(frozen=True, slots=True)
class Timeline:
    """Everything of a test that has a time.

    Attributes:
        axis: the span of time.
        faults: those that came.
        events: actions, and expectations that were missed.
        lanes: the signals.
        left_out: what is not drawn, for people.
    """

    axis: Axis
    faults: tuple[Span, ...]
    events: tuple[Event, ...]
    lanes: tuple[Lane, ...]
    left_out: tuple[str, ...]

    @property
    def size(self) -> int:
        """About how many characters a page needs for it."""
        lanes = sum(len(lane.path) + 400 * len(lane.words) + 1_200 for lane in self.lanes)
        bands = len(self.faults) * len(self.lanes) * 80
        return lanes + bands + 300 * (len(self.events) + len(self.faults))


def timeline_of(test: TestRecord) -> Timeline | None:
    """Return the time line of a test, None if there is nothing on it."""
    if not (test.series or test.faults):
        return None
    axis = _axis_of(test)
    came = [fault for fault in test.faults if fault.from_us is not None]
    drawn = [series for series in test.series if series.points]
    many = ((len(came) - MOST_FAULTS, "fault"), (len(drawn) - MOST_LANES, "signal"))
    return Timeline(
        axis,
        tuple(_fault_span(fault, axis) for fault in came[:MOST_FAULTS]),
        tuple(_events(test.journal, axis)),
        tuple(lane_of(series, axis) for series in drawn[:MOST_LANES]),
        tuple(counted(number, noun) for number, noun in many if number > 0),
    )


def _axis_of(test: TestRecord) -> Axis:
    times = [at_us for series in test.series for at_us, _ in series.points]
    for fault in test.faults:
        times += [at_us for at_us in (fault.from_us, fault.to_us) if at_us is not None]
    end_us = test.virtual_us or 0
    to_us = end_us or max(times, default=0)
    from_us = min(times, default=0)
    if from_us < to_us / 2:
        from_us = min(0, from_us)
    return Axis(from_us, max(to_us, from_us + 1))


def _fault_span(fault: PlannedFault, axis: Axis) -> Span:
    left = axis.part(fault.from_us or 0)
    right = 100.0 if fault.to_us is None else axis.part(fault.to_us)
    return Span(left, round(right - left, 2), fault.name[:WORD_CHARACTERS])


def _events(journal: Sequence[JournalLine], axis: Axis) -> Iterator[Event]:
    seen = [line for line in journal if line.mark in (ACTION, MISS)][-MOST_EVENTS:]
    for line in seen:
        yield Event(axis.part(line.at_us), line.text[:EVENT_CHARACTERS], line.mark == MISS)
