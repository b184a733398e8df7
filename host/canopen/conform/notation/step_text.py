"""Steps of a check, one a line, in the notation of docs/reference/canopen/conform.md.

>>> parse_step("3..5 x $heartbeat#05 in 400 ms")
{'count': '$heartbeat#05', 'for': 400, 'min': 3, 'max': 5}
>>> parse_step("refuse write $ro_u8 00 06010002 06010000")
{'refuse write': '$ro_u8', 'data': '00', 'codes': ['06010002', '06010000']}
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from tickrig.host.canopen.conform.check import Step

FINALLY: Final = "finally "
"""Begins a step that is done at the end, however the check went; it fails no check."""

GIVEN: Final = "given "
"""Begins a step that prepares: if the node does not do it, the check says nothing of the node."""

ANSWER_MS: Final = 1_000
"""How long is waited for an answer where a check says nothing: CiA 301 gives no time."""


def parse_step(line: str) -> Step:
    """Read a line.

    Raises:
        ValueError: it is none of the notation.
    """
    if line.startswith(FINALLY):
        return {**parse_step(line.removeprefix(FINALLY)), "finally": True}
    if line.startswith(GIVEN):
        return {**parse_step(line.removeprefix(GIVEN)), "given": True}
    for pattern, make in _NOTATIONS:
        match = pattern.fullmatch(line)
        if match is not None:
            return make(*match.groups())
    raise ValueError(f"{line!r} is no step; docs/reference/canopen/conform.md has the notation")


def _expect(patterns: str, within_ms: str | None) -> Step:
    return {"expect": patterns.split(" or "), "in": int(within_ms or ANSWER_MS)}


def _count(least: str, most: str, pattern: str, for_ms: str) -> Step:
    return {"count": pattern, "for": int(for_ms), "min": int(least), "max": int(most)}


def _period(times: str, pattern: str, period_ms: str) -> Step:
    return {"period": pattern, "each": int(period_ms), "times": int(times)}


def _send(frame: str, extended: str | None) -> Step:
    return {"send": frame, "ext": True} if extended else {"send": frame}


def _act(words: str, within_ms: str | None) -> Step:
    return {"app": words.split()} | ({"in": int(within_ms)} if within_ms else {})


def _refuse_write(target: str, data: str, codes: str) -> Step:
    return {"refuse write": target, "data": data, "codes": codes.split()}


def _refuse_read(target: str, codes: str) -> Step:
    return {"refuse read": target, "codes": codes.split()}


def _macro(name: str, words: str) -> Step:
    return {"macro": [name, *words.split()]}


_LINES: Final[tuple[tuple[str, Callable[..., Step]], ...]] = (
    (r"> (\S+)( \(29-bit\))?", _send),
    (r"< (.+?)(?: within (\d+) ms)?", _expect),
    (r"none on (\S+) for (\d+) ms", lambda can_id, ms: {"none": can_id, "for": int(ms)}),
    (r"wait (\d+) ms", lambda ms: {"wait": int(ms)}),
    (r"forget (\S+)", lambda can_id: {"forget": can_id}),
    (r"(\d+)\.\.(\d+) x (\S+) in (\d+) ms", _count),
    (r"(\d+) x (\S+) each (\d+) ms", _period),
    (r"power cycle", lambda: {"app": ["power-cycle"]}),
    (r"app: (.+?)(?: within (\d+) ms)?", _act),
    (r"macro (\w+)((?: \S+)*)", _macro),
    (r"write (\S+) (\S+)", lambda target, data: {"write": target, "data": data}),
    (r"read (\S+) not (\S+)", lambda target, data: {"read": target, "not": data}),
    (r"read (\S+) (\S+)", lambda target, data: {"read": target, "data": data}),
    (r"refuse write (\S+) (\S+) (.+)", _refuse_write),
    (r"refuse read (\S+) (.+)", _refuse_read),
    (r"keep (\S+)", lambda target: {"keep": target}),
)
_NOTATIONS: Final = tuple((re.compile(pattern), make) for pattern, make in _LINES)
