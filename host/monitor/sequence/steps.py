"""What a sequence is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.monitor.frames.record import Record
from tickrig.wire.can import Frames

Place = tuple[str | int, ...]
"""Where a step stands in its file: keys and indices, or the number of a line."""

FOREVER: Final = 0
"""As `times` of a repetition."""


@dataclass(frozen=True, slots=True)
class Condition:
    """What is waited for, as it was written, and what decides."""

    text: str
    matches: Callable[[Record], bool]


@dataclass(frozen=True, slots=True)
class Send:
    """Send frames, one behind the other."""

    place: Place
    frames: Frames


@dataclass(frozen=True, slots=True)
class Wait:
    """Wait, counted from when the step before was due."""

    place: Place
    wait_us: int


@dataclass(frozen=True, slots=True)
class Expect:
    """Wait for frames, in any order; the first that fits a condition meets it.

    Attributes:
        place: where it stands.
        conditions: all must be met.
        within_us: how long, from the step before.
        goes_on: carry on when it is missed; else the sequence ends there.
        on_fail: steps that are done first when it is missed.
    """

    place: Place
    conditions: tuple[Condition, ...]
    within_us: int
    goes_on: bool = False
    on_fail: tuple[Step, ...] = ()


@dataclass(frozen=True, slots=True)
class Repeat:
    """Do steps several times; `FOREVER` until it is stopped."""

    place: Place
    times: int
    steps: tuple[Step, ...]


Step = Send | Wait | Expect | Repeat


@dataclass(frozen=True, slots=True)
class Sequence:
    """Steps, and how a place in them is told.

    Attributes:
        steps: in their order.
        locate: returns `FILE:LINE` of a place.
    """

    steps: tuple[Step, ...]
    locate: Callable[[Place], str]


def takes_time(steps: tuple[Step, ...]) -> bool:
    """Say whether steps wait for anything, so that they may be repeated for ever."""
    return any(
        isinstance(step, Expect)
        or (isinstance(step, Wait) and step.wait_us > 0)
        or (isinstance(step, Repeat) and takes_time(step.steps))
        for step in steps
    )


def outline(steps: tuple[Step, ...], depth: int = 0) -> list[str]:
    """Return the steps as lines for people, indented where they are repeated."""
    lines = []
    for step in steps:
        text, inner = _configured(step)
        lines += ["  " * depth + text, *outline(inner, depth + 1)]
    return lines


def _configured(step: Step) -> tuple[str, tuple[Step, ...]]:
    match step:
        case Send(_, frames):
            return "send " + " ".join(map(str, frames)), ()
        case Wait(_, wait_us):
            return f"wait {wait_us / 1_000:g} ms", ()
        case Expect(_, conditions, within_us, goes_on, on_fail):
            wanted = " and ".join(condition.text for condition in conditions)
            then = "go on" if goes_on else "stop"
            return f"expect {wanted} within {within_us / 1_000:g} ms, else {then}", on_fail
        case Repeat(_, times, inner):
            return f"repeat {times or 'forever'}", inner
