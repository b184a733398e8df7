"""Compare what a device said with what an emulator says to the same host."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tickrig.emulators.record.tolerance import Tolerance


class Said(NamedTuple):
    """A line or frame that a device said.

    Attributes:
        at_us: when it had passed, from the begin of the recording.
        text: as a trace has it.
        line: of the trace, 0 if it is not of one.
    """

    at_us: int
    text: str
    line: int = 0


@dataclass(frozen=True, slots=True)
class Pair:
    """What was recorded, and what the emulator says there.

    Attributes:
        kind: within which the order counts.
        recorded: None if it is of the emulator alone.
        emulated: None if the emulator does not say it.
        difference: what differs, in words; empty if it is the same.
    """

    kind: str
    recorded: Said | None
    emulated: Said | None
    difference: str = ""

    @property
    def at_us(self) -> int:
        """When it was, first in the recording."""
        said = self.recorded or self.emulated
        assert said is not None
        return said.at_us

    @property
    def late_us(self) -> int:
        """By how much the emulator is later; 0 if one of the two is missing."""
        if self.recorded is None or self.emulated is None:
            return 0
        return self.emulated.at_us - self.recorded.at_us


def compare(
    recorded: Iterable[Said], emulated: Iterable[Said], until_us: int, tolerance: Tolerance
) -> list[Pair]:
    """Compare two runs, kind by kind.

    What an emulator says within the tolerance of the begin and of the end of the recording may
    be missing there.

    Args:
        recorded: what was recorded, in the order of time.
        emulated: what the emulator says, in the order of time.
        until_us: how long the recording lasted.
        tolerance: what counts as the same.

    Returns:
        All that was said, in the order of time.
    """
    sides: dict[str, tuple[list[Said], list[Said]]] = {}
    for side, run in enumerate((recorded, emulated)):
        for said in run:
            if not tolerance.ignores(said.text):
                sides.setdefault(tolerance.kind(said.text), ([], []))[side].append(said)
    span = range(tolerance.time_us, until_us - tolerance.allowed_us(until_us) + 1)
    pairs = [
        pair
        for kind, (then, now) in sides.items()
        for pair in _Alignment(kind, then, now, tolerance).pairs()
        if pair.recorded is not None or pair.at_us in span
    ]
    return sorted(pairs, key=lambda pair: pair.at_us)


class _Alignment:
    """Two runs of one kind, side by side."""

    def __init__(
        self, kind: str, then: Sequence[Said], now: Sequence[Said], tolerance: Tolerance
    ) -> None:
        self._kind, self._then, self._now, self._tolerance = kind, then, now, tolerance

    def pairs(self) -> Iterator[Pair]:
        """Give both runs, in order."""
        place = other = 0
        while place < len(self._then) or other < len(self._now):
            pair = self._next(place, other)
            yield pair
            place += pair.recorded is not None
            other += pair.emulated is not None

    def _next(self, place: int, other: int) -> Pair:
        """Return what comes next: of one of them, or of both."""
        if place < len(self._then) and other < len(self._now):
            return self._both(place, other)
        return self._missing(place) if place < len(self._then) else self._extra(other)

    def _both(self, place: int, other: int) -> Pair:
        old, new = self._then[place], self._now[other]
        if self._fits(place, other):
            return Pair(self._kind, old, new)
        if self._fits(place, other + 1):
            return self._extra(other)
        if self._fits(place + 1, other):
            return self._missing(place)
        if difference := self._difference(old, new):
            return Pair(self._kind, old, new, difference)
        return self._missing(place) if old.at_us < new.at_us else self._extra(other)

    def _difference(self, old: Said, new: Said) -> str:
        """Return how two differ that belong together; empty if they do not."""
        if self._near(old, new):
            return "the emulator says something else"
        if not self._tolerance.same(old.text, new.text):
            return ""
        late_ms = (new.at_us - old.at_us) / 1_000
        return f"the emulator is {abs(late_ms):.1f} ms {'later' if late_ms > 0 else 'earlier'}"

    def _fits(self, place: int, other: int) -> bool:
        """Say whether two of them are the same at the same time."""
        if place >= len(self._then) or other >= len(self._now):
            return False
        old, new = self._then[place], self._now[other]
        return self._near(old, new) and self._tolerance.same(old.text, new.text)

    def _near(self, old: Said, new: Said) -> bool:
        return abs(old.at_us - new.at_us) <= self._tolerance.allowed_us(old.at_us)

    def _missing(self, place: int) -> Pair:
        return Pair(self._kind, self._then[place], None, "the emulator does not say it")

    def _extra(self, other: int) -> Pair:
        return Pair(self._kind, None, self._now[other], "the emulator alone says it")
