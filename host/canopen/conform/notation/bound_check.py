"""A check with the numbers of one node in place of names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tickrig.host.canopen.conform.check import Check, Step
from tickrig.host.canopen.conform.notation.names import (
    NAME,
    Address,
    Names,
    resolve,
    resolve_address,
)

TARGETS: Final = frozenset({"write", "read", "refuse write", "refuse read", "keep"})
"""Steps of an object; what their first word names is an address."""

WRITES: Final = frozenset({"write", "refuse write", "keep"})
DOWNLOADS: Final = frozenset({"segdn", "blkdn"})
"""Macros that write the object that they name first."""


@dataclass(frozen=True, slots=True)
class BoundCheck:
    """A check on one node.

    Attributes:
        check: as it is written down.
        steps: with numbers; an object is its index and sub-index.
        written: objects that it may change, whether or not the node should let it.
        can_ids: of the frames that it looks at.
    """

    check: Check
    steps: tuple[Mapping[str, Any], ...]
    written: frozenset[Address]
    can_ids: frozenset[str]


def bind_check(check: Check, names: Names) -> BoundCheck:
    """Put numbers in place of names; Unbound if the node has nothing for one."""
    steps = tuple(_bind_step(step, names) for step in check.steps)
    request = resolve("$request", names)
    written = frozenset(address for step in steps for address in _written(step, request))
    can_ids = frozenset(text.partition("#")[0] for step in steps for text in _watched(step))
    return BoundCheck(check, steps, written, can_ids)


def _bind_step(step: Step, names: Names) -> Mapping[str, Any]:
    return {key: _bind(key, value, names) for key, value in step.items()}


def _bind(key: str, value: object, names: Names) -> object:
    if key in TARGETS:
        return resolve_address(str(value), names)
    if isinstance(value, str):
        return resolve(value, names)
    if isinstance(value, list):
        bind = _bind_word if key == "macro" else resolve
        return [bind(str(word), names) for word in value]
    return value


def _bind_word(word: str, names: Names) -> object:
    """Bind a word of a macro: a name without attribute is an object."""
    match = NAME.fullmatch(word)
    return resolve(word, names) if match is None or match[2] else names.address(match[1])


def _written(step: Mapping[str, Any], request: str) -> Iterator[Address]:
    for key in WRITES & step.keys():
        yield step[key]
    if "macro" in step and step["macro"][0] in DOWNLOADS:
        yield step["macro"][1]
    can_id, _, data = str(step.get("send", "")).partition("#")
    if can_id == request and len(data) >= 8 and data[0] in "23CDcd":
        yield int(data[4:6] + data[2:4], 16), int(data[6:8], 16)


def _watched(step: Mapping[str, Any]) -> Iterator[str]:
    yield from step.get("expect", ())
    for key in ("none", "count", "period", "forget"):
        if key in step:
            yield step[key]
