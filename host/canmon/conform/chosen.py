"""Which checks `--only` names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tickrig.host.canopen.conform.check import Check, ConformancePlan, Level
from tickrig.host.canopen.conform.suite import OBJECTS, group_titles, suite_checks
from tickrig.host.cli.messages import Refused
from tickrig.host.text.names import closest


def patterns(only: str | Iterable[str]) -> tuple[str, ...]:
    """Return the groups and ids that were named, each for itself.

    >>> patterns("NMT,HB"), patterns(["PR-*", "UE-01"])
    (('NMT', 'HB'), ('PR-*', 'UE-01'))
    """
    words = (only,) if isinstance(only, str) else tuple(only)
    return tuple(part.strip() for word in words for part in word.split(","))


def unknown(words: Iterable[str]) -> list[str]:
    """Say of each word that names no check that it does not, and what could be meant.

    Args:
        words: groups or ids, with * and ?.
    """
    suite = suite_checks()

    def is_one(word: str) -> bool:
        plan = ConformancePlan(Level.INTRUSIVE, (word,))
        return word.upper().startswith(OBJECTS) or any(map(plan.chooses, suite))

    none = (word for word in words if not is_one(word))
    return [f"{word}: no such group or check; {_near(word, suite)}" for word in none]


def chosen(only: Sequence[str]) -> list[Check]:
    """Return the checks of the suite that were chosen, whatever their level.

    Args:
        only: groups or ids, with * and ?; all if empty.

    Raises:
        Refused: a word that names none.
    """
    for text in unknown(only):
        raise Refused(f"--only {text}; see --list")
    return list(filter(ConformancePlan(Level.INTRUSIVE, tuple(only)).chooses, suite_checks()))


def _near(word: str, suite: list[Check]) -> str:
    """Say which name could be meant, or which groups there are."""
    groups = list(group_titles())
    if close := closest(word.upper(), sorted([*groups, *(check.id for check in suite)])):
        return f"did you mean {close[0]!r}?"
    return f"groups: {', '.join(groups)}"


def check_chosen(only: Sequence[str], level: Level) -> None:
    """Refused if a word names no check, or none that this level allows."""
    chosen(only)
    for word in only:
        named = chosen([word])
        least = min((check.level for check in named), default=level)
        if least > level:
            raise Refused(f"--only {word} needs --{least.word}")
