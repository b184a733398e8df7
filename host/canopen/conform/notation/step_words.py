"""Steps written as they are read, for people: what `step_text` reads, and steps of objects.

>>> step_words({"refuse write": (0x1000, 0), "data": "00", "codes": ["06010002"]})
'refuse write 1000:00 00 06010002'
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tickrig.host.canopen.conform.notation.step_text import ANSWER_MS, FINALLY, GIVEN

GROWN: Final = {0: "again", 1: "a byte longer", -1: "a byte shorter"}


def step_words(step: Mapping[str, Any]) -> str:
    """Write a step, with names or with the numbers of a node."""
    head = FINALLY * ("finally" in step) + GIVEN * ("given" in step)
    return head + (_of_bus(step) or _of_object(step))


TEMPLATES: Final = {
    "send": "> {send}",
    "none": "none on {none} for {for} ms",
    "count": "{min}..{max} x {count} in {for} ms",
    "period": "{times} x {period} each {each} ms",
    "wait": "wait {wait} ms",
    "forget": "forget {forget}",
}
LONGEST: Final = 60
FRAMES: Final = frozenset({"send", "expect", "none", "count", "period", "wait", "forget"})
"""Steps whose failure tells itself which frames were meant."""


def step_head(step: Mapping[str, Any]) -> str:
    """Write what a step does, without the codes that are wanted; empty if it is of frames."""
    if FRAMES & step.keys():
        return ""
    words = step_words({key: value for key, value in step.items() if key != "codes"})
    return words if len(words) <= LONGEST else f"{words[:LONGEST]}..."


def _of_bus(step: Mapping[str, Any]) -> str:
    for word, text in TEMPLATES.items():
        if word in step:
            return text.format_map(step) + (" (29-bit)" if step.get("ext") else "")
    match step:
        case {"expect": patterns, "in": ms}:
            return f"< {' or '.join(patterns)}" + (f" within {ms} ms" if ms != ANSWER_MS else "")
        case {"app": ["power-cycle"]}:
            return "power cycle"
        case {"app": words}:
            return f"app: {' '.join(words)}" + (f" within {step['in']} ms" if "in" in step else "")
        case {"macro": words}:
            return " ".join(["macro", *map(_word, words)])
    return ""


def _of_object(step: Mapping[str, Any]) -> str:
    match step:
        case {"refuse rewrite": at, "grow": grow}:
            return f"write {_word(at)} {GROWN[grow]}"
        case {"holds": at}:
            return f"read {_word(at)}"
        case {"read": at, "not": data}:
            return f"read {_word(at)} not {data}"
    verb = next(iter(step))
    return " ".join([verb, _word(step[verb]), *_data(step)])


def _data(step: Mapping[str, Any]) -> list[str]:
    return [*([step["data"]] if "data" in step else []), *step.get("codes", ())]


def _word(word: object) -> str:
    return f"{word[0]:04X}:{word[1]:02X}" if isinstance(word, tuple) else str(word)
