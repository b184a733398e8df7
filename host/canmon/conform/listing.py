"""The list of checks: names, levels, titles, and what their groups are about."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from tickrig.host.canmon.conform.chosen import chosen
from tickrig.host.canopen.conform.check import Check, Level
from tickrig.host.canopen.conform.notation.suite import OBJECTS, group_titles
from tickrig.host.canopen.conform.objects.object_checks import object_checks
from tickrig.host.canopen.conform.plan import Plan
from tickrig.wire.canopen.eds.eds_device import EdsDevice

ANY_NODE_ID: Final = 1
NAMED: Final = ", which --eds FILE names"


def listed_checks(only: Sequence[str], device: EdsDevice | None) -> Iterator[str]:
    """Yield a line a check, whatever its level, and then a line a group.

    Args:
        only: groups or ids, with * and ?, in any case; all if empty.
        device: what an EDS says, for the checks of its objects.

    Raises:
        Refused: a word that names none.
    """
    checks = [*chosen(only), *_of_objects(only, device)]
    wide = max((len(check.id) for check in checks), default=0) + 2
    yield from (f"{check.id:<{wide}}{check.level.word:<15}{check.title}" for check in checks)
    yield ""
    groups = {check.group for check in checks}
    unnamed = device is None and (not only or any(map(_is_of_objects, only)))
    for name, title in group_titles().items():
        if name in groups or (name == OBJECTS and unnamed):
            yield f"{name:<5}{title}{NAMED if name == OBJECTS and unnamed else ''}"


def _of_objects(only: Sequence[str], device: EdsDevice | None) -> list[Check]:
    made = object_checks(device, ANY_NODE_ID) if device else ()
    return list(filter(Plan(Level.INTRUSIVE, tuple(only)).chooses, made))


def _is_of_objects(word: str) -> bool:
    return word.upper().startswith(OBJECTS)
