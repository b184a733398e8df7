"""What a test needs of its bench, and what of it is not there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

import pytest

from tickrig.emulators.bench.names import known
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.checks.dead_threads import THREADS
from tickrig.emulators.testing.plugin.checks.health import ERRORS, LOST
from tickrig.emulators.testing.plugin.checks.time_of_test import CLOCK
from tickrig.emulators.testing.plugin.settings import MODES

if TYPE_CHECKING:
    from tickrig.emulators.testing.bench.bench import Bench

ALLOWED: Final = (ERRORS, LOST, CLOCK, THREADS)
HAND: Final = "hand"
OR: Final = " or "


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
        if choice not in (*MODES, HAND) and choice.partition(":")[0] not in KINDS:
            kinds = ", ".join((*MODES, HAND, *(f"{kind}:NAME" for kind in KINDS)))
            raise ValueError(f"needs({choice!r}): nobody has that; known: {kinds}")
    return needs


def check_mode(needs: Iterable[str], mode: str) -> None:
    """Raise NotOnThisBench if a test needs another kind of bench, before this one is opened."""
    for need in needs:
        choices = need.split(OR)
        if mode not in choices and all(choice in MODES for choice in choices):
            raise NotOnThisBench(f"needs {need}, and this bench is {mode}")


def check_needs(needs: Iterable[str], bench: Bench) -> None:
    """Raise NotOnThisBench if a bench has not all of what a test needs."""
    for need in needs:
        lacks = [_lack(choice, bench) for choice in need.split(OR)]
        if all(lacks):
            raise NotOnThisBench(f"needs {need}: {' and '.join(lacks)}")


def _lack(choice: str, bench: Bench) -> str:
    """Say why a bench has not what is needed; empty if it has."""
    if choice in MODES:
        return "" if choice == bench.mode else f"this bench is {bench.mode}"
    if choice == HAND:
        return "" if _described(bench).get("inputs") else "nobody can set anything here"
    kind, _, name = choice.partition(":")
    there = list(KINDS[kind](bench))
    found = any(each == name or each.endswith(f"/{name}") for each in there)  # of any device
    return "" if found else f"no {kind} {name!r}; known: {known(there) or 'none'}"


def _described(bench: Bench) -> Mapping[str, Any]:  # an answer of the control socket
    try:
        return bench.describe()
    except NotOnThisBench:
        return {"inputs": [], "groups": {}, "outputs": [], "wire_faults": []}


def _inputs(bench: Bench) -> list[str]:
    described = _described(bench)
    return [*(item["name"] for item in described["inputs"]), *described["groups"]]


def _faults(bench: Bench) -> list[str]:
    described = _described(bench)
    of_devices = [item["name"] for item in described["inputs"] if item["kind"] == "fault"]
    return [*of_devices, *(item["name"] for item in described["wire_faults"])]


KINDS: Final[Mapping[str, Callable[[Bench], Iterable[str]]]] = {
    "fault": _faults,
    "input": _inputs,
    "output": lambda bench: [item["name"] for item in _described(bench)["outputs"]],
    "device": lambda bench: bench.devices,
}
"""What can be needed by name: how a bench tells what it has."""
