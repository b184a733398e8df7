"""Selection of checks by `--only`, and the list of `--list`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from tickrig.host.canopen.conform.check import Check, ConformancePlan, Level
from tickrig.host.canopen.conform.object_checks import object_checks
from tickrig.host.canopen.conform.suite import OBJECTS, chosen_checks, group_titles, suite_checks
from tickrig.host.cli.messages import Refused
from tickrig.host.text.names import closest
from tickrig.wire.canopen.eds.eds_device import EdsDevice


def patterns(only: str | Iterable[str]) -> tuple[str, ...]:
    """Return the given names of groups and ids of checks, split at commas.

    >>> patterns("NMT,HB"), patterns(["PR-*", "UE-01"])
    (('NMT', 'HB'), ('PR-*', 'UE-01'))
    """
    words = (only,) if isinstance(only, str) else tuple(only)
    return tuple(part.strip() for word in words for part in word.split(","))


def unknown(words: Iterable[str]) -> list[str]:
    """Yield an error message for each pattern of `--only` that matches no conformance check.

    Each message suggests the most similar name.

    Args:
        words: patterns of check ids or names of check groups. `*` and `?` are wildcards.
    """

    def is_one(word: str) -> bool:
        found = chosen_checks(ConformancePlan(Level.INTRUSIVE, (word,)))
        return word.upper().startswith(OBJECTS) or next(found, None) is not None

    none = [word for word in words if not is_one(word)]
    return [f"{word}: no such group or check; {_near(word)}" for word in none]


def _chosen(only: Sequence[str]) -> list[Check]:
    """Return the selected checks of the suite, of any level.

    Args:
        only: names of groups or ids, with * and ?. If it is empty, all checks are selected.

    Raises:
        Refused: a word matches no check.
    """
    for text in unknown(only):
        raise Refused(f"--only {text}; see --list")
    return list(chosen_checks(ConformancePlan(Level.INTRUSIVE, tuple(only))))


def _near(word: str) -> str:
    """Return the probable name, or the names of the groups."""
    groups = list(group_titles())
    if close := closest(word.upper(), sorted([*groups, *(check.id for check in suite_checks())])):
        return f"did you mean {close[0]!r}?"
    return f"groups: {', '.join(groups)}"


def check_chosen(only: Sequence[str], level: Level) -> None:
    """Raise Refused if a word matches no check, or no check of this level."""
    _chosen(only)
    for word in only:
        named = _chosen([word])
        least = min((check.level for check in named), default=level)
        if least > level:
            raise Refused(f"--only {word} needs --{least.word}")


# The list of checks: names, levels, titles, and descriptions of their groups.

_ANY_NODE_ID: Final = 1
_NAMED: Final = ", which --eds FILE names"


def listed_checks(only: Sequence[str], device: EdsDevice | None) -> Iterator[str]:
    """Yield the lines of `canmon conform --list`: one line per check, then one line per group.

    Checks of all levels are listed, also those that change the node.

    Args:
        only: patterns of check ids or names of check groups, in upper or lower case. `*` and `?`
            are wildcards. If it is empty, all checks are listed.
        device: device that the EDS describes, which adds one or more checks for each of its
            objects, or None without an EDS.

    Raises:
        Refused: a pattern matches no check.
    """
    checks = [*_chosen(only), *_of_objects(only, device)]
    wide = max((len(check.id) for check in checks), default=0) + 2
    yield from (f"{check.id:<{wide}}{check.level.word:<15}{check.title}" for check in checks)
    yield ""
    groups = {check.group for check in checks}
    unnamed = device is None and (not only or any(map(_is_of_objects, only)))
    for name, title in group_titles().items():
        if name in groups or (name == OBJECTS and unnamed):
            yield f"{name:<5}{title}{_NAMED if name == OBJECTS and unnamed else ''}"


def _of_objects(only: Sequence[str], device: EdsDevice | None) -> list[Check]:
    made = object_checks(device, _ANY_NODE_ID) if device else ()
    return list(filter(ConformancePlan(Level.INTRUSIVE, tuple(only)).chooses, made))


def _is_of_objects(word: str) -> bool:
    return word.upper().startswith(OBJECTS)
