"""Compare what a device said with what an emulator says to the same host."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Final, NamedTuple

# What still counts as the same when a recording is compared with an emulator.

_DRIFT: Final = 2_000
"""Two clocks part by less than one in so many: 500 ppm."""

_ROUNDING: Final = 1e-9
"""1.1 - 1.0 is a little more than 0.1."""

_RULE: Final = re.compile(
    r"(.+?)(?:\[([0-9]{1,4}):([0-9]{1,4})\])?=([0-9]{1,12}(?:\.[0-9]{1,9})?)(%)?"
)
_NUMBER: Final = re.compile(r"(?<![\w.])[+-]?[0-9]{1,18}(?:\.[0-9]{1,9})?(?![\w.])")
_KIND: Final = re.compile(r"[A-Za-z]\w*:|[0-9A-F]{3}#|[0-9A-F]{8}#", re.ASCII)


@dataclass(frozen=True, slots=True)
class NumberRule:
    """Numbers in lines of a pattern may differ.

    Attributes:
        pattern: as file names have it: `EV:batt*`, `181#*`.
        least: by how much at most; of 100, where it is a share.
        share: it is in percent of the recorded number.
        place: of the field, None for all decimal numbers of the line: characters of a line of
            text, which are hex digits; data bytes of a frame, the lowest first.
    """

    pattern: str
    least: float
    share: bool = False
    place: tuple[int, int] | None = None

    def allows(self, recorded: str, emulated: str) -> bool:
        """Say whether two lines differ in such numbers alone, and by no more."""
        if not (fnmatchcase(recorded, self.pattern) and fnmatchcase(emulated, self.pattern)):
            return False
        split = _split_numbers if self.place is None else self._split_field
        (frame, old), (other, new) = split(recorded), split(emulated)
        if frame != other or len(old) != len(new) or not old:
            return False
        return all(self._near(a, b) for a, b in zip(old, new, strict=True))

    def _near(self, recorded: float, emulated: float) -> bool:
        least = abs(recorded) * self.least / 100 if self.share else self.least
        return abs(recorded - emulated) <= least + _ROUNDING

    def _split_field(self, text: str) -> tuple[str, list[float]]:
        """Return a line without its field, and the number in that."""
        assert self.place is not None
        first, last = self.place
        head, hash_, data = text.partition("#")
        if hash_ and _KIND.match(text):
            digits = data[2 * first : 2 * last]
            rest = f"{head}#{data[: 2 * first]}_{data[2 * last :]}"
            return rest, _little_endian(digits)
        digits = text[first:last]
        try:
            return f"{text[:first]}_{text[last:]}", [int(digits, 16)]
        except ValueError:
            return text, []


def _little_endian(digits: str) -> list[float]:
    try:
        return [int.from_bytes(bytes.fromhex(digits), "little", signed=True)] if digits else []
    except ValueError:
        return []


def _split_numbers(text: str) -> tuple[str, list[float]]:
    """Return a line with its decimal numbers taken out, and these."""
    return _NUMBER.sub("_", text), [float(number) for number in _NUMBER.findall(text)]


def parse_number_rule(text: str) -> NumberRule:
    """Read `PATTERN=TOLERANCE`, `PATTERN[FROM:TO]=TOLERANCE`, with % for a share.

    Raises:
        ValueError: it is none.

    >>> parse_number_rule("EV:batt*=5").allows("EV:batt 98", "EV:batt 95")
    True
    >>> parse_number_rule("181#*[2:4]=1%").allows("181#3702E803", "181#3702F203")
    True
    """
    match = _RULE.fullmatch(text)
    if match is None or (match[2] and int(match[2]) >= int(match[3])):
        raise ValueError(f"{text!r} is not PATTERN=TOLERANCE or PATTERN[FROM:TO]=TOLERANCE")
    place = (int(match[2]), int(match[3])) if match[2] else None
    return NumberRule(match[1], float(match[4]), bool(match[5]), place)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as the same.

    Attributes:
        time_us: how far a time may be off; the drift of two clocks is added.
        numbers: how far numbers may be.
        ignored: patterns of lines that are not compared.
        kinds: patterns of lines that are independent of all others: they need not come in the
            order in which they were recorded.
    """

    time_us: int
    numbers: Sequence[NumberRule] = ()
    ignored: Sequence[str] = ()
    kinds: Sequence[str] = ()

    def allowed_us(self, at_us: int) -> int:
        """Return how far a time may be off, so long after the begin."""
        return self.time_us + at_us // _DRIFT

    def same(self, recorded: str, emulated: str) -> bool:
        """Say whether two lines say the same."""
        return recorded == emulated or any(rule.allows(recorded, emulated) for rule in self.numbers)

    def ignores(self, text: str) -> bool:
        """Say whether a line is not compared."""
        return any(fnmatchcase(text, pattern) for pattern in self.ignored)

    def kind(self, text: str) -> str:
        """Return what keeps its order: lines up to a colon, frames of a CAN-ID, or a pattern."""
        for pattern in self.kinds:
            if fnmatchcase(text, pattern):
                return pattern
        match = _KIND.match(text)
        return match[0][:-1] if match else ""


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
