"""Comparison of a recorded device with an emulator for the same host."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Final, NamedTuple

# Tolerances for the comparison of a recording with an emulator.

_DRIFT: Final = 2_000
"""Reciprocal of the largest drift between two clocks: 500 ppm."""

_ROUNDING: Final = 1e-9
"""Tolerance for rounding: 1.1 - 1.0 is a little more than 0.1."""

_RULE: Final = re.compile(
    r"(.+?)(?:\[([0-9]{1,4}):([0-9]{1,4})\])?=([0-9]{1,12}(?:\.[0-9]{1,9})?)(%)?"
)
_NUMBER: Final = re.compile(r"(?<![\w.])[+-]?[0-9]{1,18}(?:\.[0-9]{1,9})?(?![\w.])")
_KIND: Final = re.compile(r"[A-Za-z]\w*:|[0-9A-F]{3}#|[0-9A-F]{8}#", re.ASCII)


@dataclass(frozen=True, slots=True)
class NumberRule:
    """Tolerance for the numbers in lines or frames that match a pattern.

    `tickrig compare` uses such rules when it compares a recording with an emulator.

    Attributes:
        pattern: shell pattern of the whole line or frame, such as `EV:batt*` or `181#*`.
        least: allowed difference between the recorded and the emulated number. If `share` is true,
            the difference is given in per cent of the recorded number.
        share: whether `least` is given in per cent.
        place: first position and end of the number in the line, or None for all decimal numbers of
            the line. Positions count the characters (hex digits) of a text line, or the data bytes
            of a frame. A number in a frame has its lowest byte first.
    """

    pattern: str
    least: float
    share: bool = False
    place: tuple[int, int] | None = None

    def allows(self, recorded: str, emulated: str) -> bool:
        """Return whether two lines differ only in the rule's numbers, within the tolerance."""
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
        """Return a line without its field, and the number in the field."""
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
    """Return a line without its decimal numbers, and the numbers."""
    return _NUMBER.sub("_", text), [float(number) for number in _NUMBER.findall(text)]


def parse_number_rule(text: str) -> NumberRule:
    """Parse a number tolerance: `PATTERN=TOLERANCE` or `PATTERN[FROM:TO]=TOLERANCE`.

    PATTERN selects lines or frames. In a selected line or frame the number begins at the position
    FROM, and ends before the position TO. Positions count the characters of a line, or the data
    bytes of a frame, from 0.

    A tolerance that ends in `%` is a percentage of the recorded number.

    Raises:
        ValueError: the text does not have one of these forms.

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
    """Allowed deviations of an emulated run from a recorded run.

    Attributes:
        time_us: largest allowed difference between a recorded time and an emulated time, in
            microseconds. It applies at the start of the run. Later the method `allowed_us` allows
            more, because clocks drift.
        numbers: tolerances of numbers in lines.
        ignored: patterns of lines that are not compared.
        kinds: patterns, each for one kind of lines. The order of lines is compared only within a
            kind. So the emulator may send lines of different kinds in another order than the
            recording.
    """

    time_us: int
    numbers: Sequence[NumberRule] = ()
    ignored: Sequence[str] = ()
    kinds: Sequence[str] = ()

    def allowed_us(self, at_us: int) -> int:
        """Return the tolerance of a time that is `at_us` after the start."""
        return self.time_us + at_us // _DRIFT

    def same(self, recorded: str, emulated: str) -> bool:
        """Return whether two lines are equal within the tolerances."""
        return recorded == emulated or any(rule.allows(recorded, emulated) for rule in self.numbers)

    def ignores(self, text: str) -> bool:
        """Return whether a line is ignored."""
        return any(fnmatchcase(text, pattern) for pattern in self.ignored)

    def kind(self, text: str) -> str:
        """Return the kind of a line, by which `compare` sorts lines.

        The kind is the pattern of `kinds` that matches the line. Otherwise it is the text before a
        colon, or the CAN-ID of a frame.

        The order of lines is compared only within a kind.
        """
        for pattern in self.kinds:
            if fnmatchcase(text, pattern):
                return pattern
        match = _KIND.match(text)
        return match[0][:-1] if match else ""


class Said(NamedTuple):
    """A line or frame that a device has sent, for the function `compare`.

    Attributes:
        at_us: time at which the line or frame ended, in microseconds since the start of the
            recording.
        text: text of the line or frame, as in a trace.
        line: line number in the trace file, or 0 if the line is not from a trace.
    """

    at_us: int
    text: str
    line: int = 0


@dataclass(frozen=True, slots=True)
class Pair:
    """A recorded line and the emulator's line that `compare` has matched with it.

    Attributes:
        kind: kind of the line, such as its CAN-ID. `compare` checks the order of lines only within
            a kind.
        recorded: recorded line, or None if only the emulator sent the line.
        emulated: line of the emulator, or None if the emulator did not send the line.
        difference: description of the difference, or an empty text if the lines are equal.
    """

    kind: str
    recorded: Said | None
    emulated: Said | None
    difference: str = ""

    @property
    def at_us(self) -> int:
        """Time of the pair, from the recording if possible."""
        said = self.recorded or self.emulated
        assert said is not None
        return said.at_us

    @property
    def late_us(self) -> int:
        """Delay of the emulator, or 0 if one of the two lines is missing."""
        if self.recorded is None or self.emulated is None:
            return 0
        return self.emulated.at_us - self.recorded.at_us


def compare(
    recorded: Iterable[Said], emulated: Iterable[Said], until_us: int, tolerance: Tolerance
) -> list[Pair]:
    """Compare the lines that a device has sent in a recording with those of an emulator.

    The order of lines is compared only within a kind (`Tolerance.kind`). A line of the emulator may
    have no counterpart in the recording. Such a line is ignored if it is near the start or the end
    of the recording, that is, within the time tolerance.

    Args:
        recorded: recorded lines in order of time.
        emulated: lines of the emulator in order of time.
        until_us: duration of the recording in microseconds.
        tolerance: the allowed deviations.

    Returns:
        All lines as pairs, in order of time.
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
        """Yield both runs, in order."""
        place = other = 0
        while place < len(self._then) or other < len(self._now):
            pair = self._next(place, other)
            yield pair
            place += pair.recorded is not None
            other += pair.emulated is not None

    def _next(self, place: int, other: int) -> Pair:
        """Return the next line of one run, or the next pair."""
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
        """Return the difference of a pair, or "" if there is none."""
        if self._near(old, new):
            return "the emulator answers differently"
        if not self._tolerance.same(old.text, new.text):
            return ""
        late_ms = (new.at_us - old.at_us) / 1_000
        return f"the emulator is {abs(late_ms):.1f} ms {'later' if late_ms > 0 else 'earlier'}"

    def _fits(self, place: int, other: int) -> bool:
        """Return whether two lines have equal text and time within the tolerances."""
        if place >= len(self._then) or other >= len(self._now):
            return False
        old, new = self._then[place], self._now[other]
        return self._near(old, new) and self._tolerance.same(old.text, new.text)

    def _near(self, old: Said, new: Said) -> bool:
        return abs(old.at_us - new.at_us) <= self._tolerance.allowed_us(old.at_us)

    def _missing(self, place: int) -> Pair:
        return Pair(self._kind, self._then[place], None, "the emulator does not send it")

    def _extra(self, other: int) -> Pair:
        return Pair(self._kind, None, self._now[other], "only the emulator sends it")
