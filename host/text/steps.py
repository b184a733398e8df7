"""Steps of scenarios and sequences, with time, action, expectations and repetition.

Scenarios and sequences share this model, but have different syntaxes:

- A scenario consists of lines with times from the start (docs/reference/bench/scenario.md).
- A sequence is TOML or consists of lines. Each step follows the previous one
  (docs/reference/canmon/canmon-sending.md).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

Place = str | tuple[str | int, ...]
"""Place of a step in its file: `FILE:LINE`, keys and indices, or a line number."""

_What = TypeVar("_What")
_Came = TypeVar("_Came")

FOREVER: Final = 0
"""Value of `times` for endless repetition."""

_COMMENT: Final = re.compile(r"(^|\s)#.*")


class StepError(ValueError):
    """Raised if the steps in a file of the user are invalid.

    The message has the form `FILE:LINE: the value, and what is allowed`.
    """


@dataclass(frozen=True)  # with slots, Python 3.11 cannot make a `Condition[str]`
class Condition(Generic[_Came]):
    """An event that a step waits for: its text in the file, and a function that recognizes it."""

    text: str
    matches: Callable[[_Came], bool]


@dataclass(frozen=True, kw_only=True)
class Step(Generic[_What, _Came]):
    """One step of a sequence.

    The parts of a step run in the order of the attributes. Most steps have only one part.

    Attributes:
        place: place of the step in its file.
        at_us: time in microseconds after the previous step was due, or in a scenario after its
            start.
        what: action of the step, or None for no action.
        wanted: expectations in any order. The first match of an expectation meets it.
        within_us: time limit for the expectations, from `at_us`.
        goes_on: whether to continue after a missed expectation. Otherwise the steps end.
        on_fail: steps that run first after a missed expectation.
        times: number of repetitions of `steps`, or None for no repetition. `FOREVER` repeats the
            steps until they are stopped.
        steps: steps that are repeated.
    """

    place: Place
    at_us: int | None = None
    what: _What | None = None
    wanted: tuple[Condition[_Came], ...] = ()
    within_us: int = 0
    goes_on: bool = False
    on_fail: tuple[Step[_What, _Came], ...] = ()
    times: int | None = None
    steps: tuple[Step[_What, _Came], ...] = ()

    @property
    def takes_time(self) -> bool:
        """Whether the step waits for anything. Only such a step may be repeated endlessly."""
        return bool(self.at_us or self.wanted) or any(step.takes_time for step in self.steps)


def content_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield each non-empty line without its comment (`#`), and its number from 1."""
    for number, line in enumerate(text.splitlines(), 1):
        if content := _COMMENT.sub("", line).strip():
            yield number, content
