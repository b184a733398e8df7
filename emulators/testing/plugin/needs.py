"""What a test needs of its bench, and what of it is not there."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from tickrig.device.physical import SignalType
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.checks.dead_threads import THREADS
from tickrig.emulators.testing.plugin.checks.health import ERRORS, LOST
from tickrig.emulators.testing.plugin.checks.time_of_test import CLOCK
from tickrig.emulators.testing.plugin.settings import MODES
from tickrig.host.text.names import closest, known, near

if TYPE_CHECKING:
    from tickrig.emulators.testing.bench.bench import Bench

ALLOWED: Final = (ERRORS, LOST, CLOCK, THREADS)
HAND: Final = "hand"
OR: Final = " or "
MEANT: Final = "did you mean"
_DIGIT: Final = re.compile("[0-9]")
"""Names that differ in a number alone, as `arm1` and `arm2`, are of different things."""


def words_of(item: pytest.Item, marker: str) -> tuple[str, ...]:
    """Return the words of all markers of a name, in the order of writing."""
    marks = list(item.iter_markers(marker))[::-1]
    return tuple(str(word) for mark in marks for word in mark.args)


def allowed_of(item: pytest.Item) -> tuple[str, ...]:
    """Return what all markers `allows` of a test name.

    Raises:
        ValueError: what no marker can allow.
    """
    allowed = words_of(item, "allows")
    for word in allowed:
        if word not in ALLOWED:
            raise ValueError(f"allows({word!r}): it can allow {', '.join(map(repr, ALLOWED))}")
    return allowed


def needs_of(item: pytest.Item) -> tuple[str, ...]:
    """Return what all markers `needs` of a test name, in the order of writing.

    Raises:
        ValueError: something that nobody could have.
    """
    needs = words_of(item, "needs")
    for choice in (choice for need in needs for choice in need.split(OR)):
        kind, _, name = choice.partition(":")
        if choice not in (*MODES, HAND) and not (kind in KINDS and name):
            kinds = [*MODES, HAND, *(f"{kind}:{name or 'NAME'}" for kind in KINDS)]
            raise ValueError(f"needs({choice!r}): nobody has that; {near(choice, kinds)}")
    return needs


def check_mode(needs: Iterable[str], mode: str) -> None:
    """Raise NotOnThisBench if a test needs another kind of bench, before this one is opened."""
    for need in needs:
        choices = need.split(OR)
        if mode not in choices and all(choice in MODES for choice in choices):
            raise NotOnThisBench(f"needs {need}, and this bench is {mode}")


def check_needs(needs: Iterable[str], bench: Bench) -> None:
    """Raise NotOnThisBench if a bench has not all of what a test needs.

    Raises:
        ValueError: a name is misspelt, so that the test would be skipped on every bench.
    """
    for need in needs:
        lacks = [_lack(choice, bench) for choice in need.split(OR)]
        if all(lacks):
            for choice, lack in zip(need.split(OR), lacks, strict=True):
                if MEANT in lack and not _is_elsewhere(choice):
                    raise ValueError(f"needs({choice!r}): {lack}")
            raise NotOnThisBench(f"needs {need}: {' and '.join(lacks)}")


def _lack(choice: str, bench: Bench) -> str:
    """Say why a bench has not what is needed; empty if it has."""
    if choice in MODES:
        return "" if choice == bench.mode else f"this bench is {bench.mode}"
    if choice == HAND:
        return "" if bench.describe().inputs else "nobody can set anything here"
    kind, _, name = choice.partition(":")
    there = [each.rpartition("/")[2] for each in KINDS[kind](bench)]  # of any device
    if name in there or name in KINDS[kind](bench):
        return ""
    others = [each for each in there if _DIGIT.sub("", each) != _DIGIT.sub("", name)]
    hint = f"{MEANT} {close[0]!r}?" if (close := closest(name, others)) else ""
    return f"no {kind} {name!r}; {hint or f'known: {known(dict.fromkeys(there))}'}"


def _is_elsewhere(choice: str) -> bool:
    """Return whether a device of another type than those of the bench has what is needed."""
    kind, _, name = choice.partition(":")
    return name in _names_anywhere().get(kind, ())


@cache
def _names_anywhere() -> dict[str, set[str]]:
    """Return the names of what device types and models have, which are made once for it."""
    from tickrig.emulators.canopen.choices import MODELS  # noqa: PLC0415 - seldom wanted
    from tickrig.emulators.commands.device_type import DEVICES  # noqa: PLC0415
    from tickrig.emulators.testing.rig_file.devices import kind_of  # noqa: PLC0415
    from tickrig.emulators.testing.rig_file.plan import DevicePlan  # noqa: PLC0415
    from tickrig.emulators.testing.rig_file.probe import Probe, probe  # noqa: PLC0415

    names: dict[str, set[str]] = {"fault": set(), "input": set(), "output": set()}
    for each in (*DEVICES.names(), *MODELS):
        kind, place = kind_of(each, Path())
        found = probe(DevicePlan(name=each, kind=kind, type=place, wire=""))
        if isinstance(found, Probe):
            inputs = found.physical.inputs
            names["fault"] |= {*inputs.names(SignalType.FAULT), *found.wire_faults}
            names["input"] |= {*inputs.table, *inputs.groups}
            names["output"] |= {*found.physical.outputs}
    return names


KINDS: Final[Mapping[str, Callable[[Bench], Iterable[str]]]] = {
    "fault": lambda bench: bench.describe().faults,
    "input": lambda bench: [*bench.describe().inputs, *bench.describe().groups],
    "output": lambda bench: bench.describe().outputs,
    "device": lambda bench: bench.devices,
}
"""What can be needed by name: how a bench tells what it has."""
