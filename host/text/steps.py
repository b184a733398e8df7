"""Steps of scenarios and sequences: when, what, what must come, how often.

It is one model with two syntaxes: scenarios are lines at times that count from the beginning
(docs/reference/bench/scenario.md); sequences are TOML or lines, each step after the one before
(docs/reference/canmon/canmon-sending.md).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

Place = str | tuple[str | int, ...]
"""Where a step stands: `FILE:LINE`, or keys and indices, or the number of a line, in its file."""

What = TypeVar("What")
Came = TypeVar("Came")

FOREVER: Final = 0
"""As `times` of a step."""

_COMMENT: Final = re.compile(r"(^|\s)#.*")


class StepError(ValueError):
    """Steps that cannot be carried out: `FILE:LINE: what came, what is allowed`."""


@dataclass(frozen=True)  # with slots, Python 3.11 cannot make a `Condition[str]`
class Condition(Generic[Came]):
    """What must come, as it was written, and what decides."""

    text: str
    matches: Callable[[Came], bool]


@dataclass(frozen=True, kw_only=True)
class Step(Generic[What, Came]):
    """One step. What stands first here is done first; most steps say one of these alone.

    Attributes:
        place: where it stands.
        at_us: when, microseconds: after the step before was due, of a scenario after its beginning.
        what: what is done then; None for nothing.
        wanted: what must come, in any order; the first that fits a condition meets it.
        within_us: how long that is waited for, from `at_us`.
        goes_on: carry on when it does not come; else the steps end there.
        on_fail: steps that are done first when it does not come.
        times: how often `steps` are done, `FOREVER` until somebody stops them; None for none.
        steps: those that are repeated.
    """

    place: Place
    at_us: int | None = None
    what: What | None = None
    wanted: tuple[Condition[Came], ...] = ()
    within_us: int = 0
    goes_on: bool = False
    on_fail: tuple[Step[What, Came], ...] = ()
    times: int | None = None
    steps: tuple[Step[What, Came], ...] = ()

    @property
    def takes_time(self) -> bool:
        """Whether it waits for anything, so that it may be repeated for ever."""
        return bool(self.at_us or self.wanted) or any(step.takes_time for step in self.steps)


def content_lines(text: str) -> Iterator[tuple[int, str]]:
    """Give each line that says something, without its comment (`#`), and its number from 1."""
    for number, line in enumerate(text.splitlines(), 1):
        if content := _COMMENT.sub("", line).strip():
            yield number, content
