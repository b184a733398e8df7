"""Which checks `--only` names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.canopen.conform.check import Check, Level
from tickrig.host.canopen.conform.notation.suite import read_suite
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.cli.refused import Refused
from tickrig.host.text.names import near

OBJECTS: Final = "OD"
"""Checks that are made of an EDS, which nobody knows before it is read."""


def chosen(only: Sequence[str]) -> list[Check]:
    """Return the checks of the suite that were chosen, whatever their level.

    Args:
        only: groups or ids, with * and ?; all if empty.

    Raises:
        Refused: a word that names none.
    """
    suite = [check for group in read_suite() for check in group.checks]
    for word in only:
        plan = Plan(Level.INTRUSIVE, (word,))
        if not word.startswith(OBJECTS) and not any(map(plan.chooses, suite)):
            names = {name for check in suite for name in (check.group, check.id)}
            hint = near(word, sorted(names))
            raise Refused(f"--only {word}: no such group or check; {hint}; see --list")
    return list(filter(Plan(Level.INTRUSIVE, tuple(only)).chooses, suite))
