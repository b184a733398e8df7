"""A check with the numbers of one node in place of names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tickrig.host.canopen.conform.check import Check, Step
from tickrig.host.canopen.conform.notation.macro_words import longest_ms, written_by
from tickrig.host.canopen.conform.notation.names import (
    ADDRESS,
    NAME,
    Address,
    Names,
    Unbound,
    resolve,
    resolve_address,
)
from tickrig.wire.canopen.sdo.sdo_command import SPECIFIER, ClientCommand

TARGETS: Final = frozenset(
    {"write", "read", "refuse write", "refuse read", "keep", "holds", "refuse rewrite"}
)
"""Steps of an object; what their first word names is an address."""
REFUSED: Final = ("refuse write", "refuse rewrite")

MARGIN_US: Final = 2_000_000
"""Beyond the sum of all waits: for what is sent, when the load has to be kept low."""

STIMULUS_MS: Final = 60_000
"""So long may the hand at the inputs take; a person is slow."""

LONGEST_TRANSFER_MS: Final = 2_000
"""So long may an object of a few bytes take."""

BLOCK_ENDS: Final = 1
"""Bit of a block download request that does not begin it."""
RESETS: Final = ("000#81", "000#82")
NMT: Final = "000"
LSS: Final = "7E5"
STORAGE: Final = (0x1010, 0x1011)

NMT_TO_ALL: Final = "send NMT commands to all nodes of the bus"
LSS_TO_ALL: Final = "send LSS requests, which every node of the bus takes"
SYNC_TO_ALL: Final = "send SYNC, which every node of the bus takes"
STORED: Final = "store parameters in the node, in place of those stored before"
"""What a person is asked."""


@dataclass(frozen=True, slots=True)
class BoundCheck:
    """A check on one node.

    Attributes:
        check: as it is written down.
        steps: with numbers; an object is its index and sub-index.
        changed: objects that it writes.
        used: objects that the node has to have.
        written: these, and those that the node must refuse to write, or may.
        questions: what a person is asked before it.
        can_ids: of the frames that it looks at.
        within_us: how long it may last at most.
        resets: it may reset the node, so that all its values change.
    """

    check: Check
    steps: tuple[Mapping[str, Any], ...]
    changed: frozenset[Address]
    used: frozenset[Address]
    written: frozenset[Address]
    questions: frozenset[str]
    can_ids: frozenset[str]
    within_us: int
    resets: bool


def bind_check(check: Check, names: Names) -> BoundCheck:
    """Put numbers in place of names; Unbound if the node has nothing for one."""
    steps = tuple(_bind_step(step, names) for step in check.steps)
    request, sync = resolve("$request", names), resolve("$sync", names)
    changed = frozenset(address for step in steps for address in _changed(step, request))
    refused = frozenset(step[key] for step in steps for key in REFUSED if key in step)
    return BoundCheck(
        check,
        steps,
        changed,
        frozenset(address for step in steps for address in _used(step)),
        changed | refused,
        frozenset(question for step in steps for question in _questions(step, sync)),
        frozenset(text.partition("#")[0] for step in steps for text in _watched(step)),
        MARGIN_US + 1_000 * sum(map(_longest_ms, steps)),
        any(map(_resets, steps)),
    )


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
    """Bind a word of a macro: an address, or a name without attribute, is an object."""
    if ADDRESS.fullmatch(word):
        return resolve_address(word, names)
    match = NAME.fullmatch(word)
    if match is None or match[3]:
        return resolve(word, names)
    try:
        return names.address(match[1] or match[2])
    except Unbound:
        return resolve(word, names)


def _longest_ms(step: Step) -> int:
    """Return how long a step lasts at most."""
    match step:
        case {"expect": _, "in": ms} | {"none": _, "for": ms} | {"count": _, "for": ms}:
            return int(ms)
        case {"wait": ms}:
            return int(ms)
        case {"period": _, "each": ms, "times": times}:
            return int(ms) * (int(times) + 2)
        case {"macro": [name, *words]}:
            return longest_ms(name, words)
        case {"app": _}:
            return STIMULUS_MS
    return 0 if {"send", "forget", "keep"} & step.keys() else LONGEST_TRANSFER_MS


def _resets(step: Step) -> bool:
    return "app" in step or str(step.get("send", ""))[:6] in RESETS


def _changed(step: Mapping[str, Any], request: str) -> Iterator[Address]:
    yield from (step[key] for key in ("write", "keep") if key in step)
    if "macro" in step:
        yield from written_by(*step["macro"])
    can_id, _, data = str(step.get("send", "")).partition("#")
    if can_id == request and len(data) >= 8 and begins_download(int(data[:2], 16)):
        yield int(data[4:6] + data[2:4], 16), int(data[6:8], 16)


def _used(step: Mapping[str, Any]) -> Iterator[Address]:
    yield from (step[key] for key in ("write", "read") if key in step)
    if "macro" in step:
        yield from (word for word in step["macro"] if isinstance(word, tuple) and word[1])
        yield from written_by(*step["macro"])


def begins_download(command: int) -> bool:
    """Return whether a request begins to write the object that it names."""
    specifier = command & SPECIFIER
    begins = specifier == ClientCommand.BLOCK_DOWNLOAD and not command & BLOCK_ENDS
    return begins or specifier == ClientCommand.DOWNLOAD


def _questions(step: Mapping[str, Any], sync: str) -> Iterator[str]:
    """Yield what concerns other nodes, or cannot be undone."""
    can_id, _, data = str(step.get("send", "")).partition("#")
    macro = step.get("macro", [""])
    if can_id == NMT and data[2:4] == "00":
        yield NMT_TO_ALL
    if can_id == LSS or macro[0] in ("fastscan", "lssstore"):
        yield LSS_TO_ALL
    if can_id == sync or macro[0] in ("sync", "syncperiod"):
        yield SYNC_TO_ALL
    if step.get("write", (0, 0))[0] in STORAGE:
        yield STORED


def _watched(step: Mapping[str, Any]) -> Iterator[str]:
    yield from step.get("expect", ())
    for key in ("none", "count", "period", "forget"):
        if key in step:
            yield step[key]
