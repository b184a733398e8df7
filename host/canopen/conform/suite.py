"""The checks of the suite, with one file per group in `checks/`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Final, NamedTuple

from tickrig.host.canopen.conform import checks
from tickrig.host.canopen.conform.check import STIMULUS, Act, Check, ConformancePlan, Level, Step
from tickrig.host.canopen.conform.notation import parse_step

_HEAD: Final = re.compile(r"([A-Z0-9]+-\d+) (.+)")
_KEYWORD: Final = re.compile(r"(source|level|needs|choice): (.+)")
_GROUP: Final = re.compile(r"group: ([A-Z0-9]+), (.+)")

ORDER: Final = (
    *("UE", "US", "BU", "DE", "DS", "BD", "SG", "NMT", "HB", "NG"),
    *("PC", "PR", "SY", "EM", "IO", "D4", "ST", "LS"),
)
"""Groups in the order in which they run. The groups that may disturb most run last."""


OBJECTS: Final = "OD"
"""The group of checks that are made from an EDS."""
_OF_EACH_OBJECT: Final = "each object of the EDS"


class _Group(NamedTuple):
    """A group of checks that belong together."""

    name: str
    title: str
    checks: tuple[Check, ...]


@cache
def _read_group(name: str) -> _Group:
    """Return a group that comes with the package."""
    return parse_group(_text(name))


def read_suite() -> tuple[_Group, ...]:
    """Return all groups of checks that tickrig contains, in the order of execution."""
    return tuple(map(_read_group, ORDER))


def suite_checks() -> list[Check]:
    """Return the checks of all groups."""
    return [check for group in read_suite() for check in group.checks]


def chosen_checks(plan: ConformancePlan) -> Iterator[Check]:
    """Yield the checks that the options of a run select.

    Files of groups without a selected check are not read.
    """
    for name in ORDER:
        if plan.may_choose(name):
            yield from filter(plan.chooses, _read_group(name).checks)


@cache
def group_titles() -> Mapping[str, str]:
    """Return the title of each group of checks, by group name. The object checks come last."""
    titles = {name: _head(_text(name).split("\n", 1)[0])[2] for name in ORDER}
    return {**titles, OBJECTS: _OF_EACH_OBJECT}


def _text(name: str) -> str:
    return files(checks).joinpath(f"{name.lower()}.txt").read_text("utf-8")


def parse_group(text: str) -> _Group:
    """Parse a file with a group of checks.

    Empty lines separate the checks. A line that begins with # is a comment.

    Raises:
        ValueError: a line is not in the notation of checks. The message contains the line.
    """
    blocks = re.split(r"\n\s*\n", re.sub(r"^#.*\n", "", text, flags=re.MULTILINE).strip())
    match = _head(blocks[0])
    return _Group(match[1], match[2], tuple(_checks(match[1], blocks[1:])))


def _head(text: str) -> re.Match[str]:
    match = _GROUP.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a head like 'group: NMT, what it is about'")
    return match


def _checks(group: str, blocks: list[str]) -> Iterator[Check]:
    for block in blocks:
        head, *lines = block.split("\n")
        match = _HEAD.fullmatch(head)
        if match is None:
            raise ValueError(f"{head!r} is not a head like 'NMT-03 what conforming means'")
        words: dict[str, str] = {}
        steps: list[Step] = []
        for line in lines:
            keyword = _KEYWORD.fullmatch(line)
            if keyword is not None:
                words[keyword[1]] = keyword[2]
            else:
                steps.append(parse_step(line))
        yield _check(match[1], group, match[2], words, tuple(steps))


def _check(
    check_id: str, group: str, title: str, words: dict[str, str], steps: tuple[Step, ...]
) -> Check:
    missing = {"source", "level"} - words.keys()
    if missing:
        raise ValueError(f"{check_id} has no {' and no '.join(sorted(missing))}")
    needs = frozenset(words.get("needs", "").split())
    if any(isinstance(step.action, Act) for step in steps):
        needs |= {STIMULUS}
    level = Level[words["level"].upper().replace("-", "_")]
    return Check(
        check_id, group, title, words["source"], level, needs, steps, words.get("choice", "")
    )
