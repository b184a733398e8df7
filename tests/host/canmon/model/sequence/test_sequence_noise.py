"""Whatever a file holds, it is a sequence or it is said why not."""

from __future__ import annotations

import json
import re
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st

from tickrig.host.canmon.model.sequence import SequenceRun, TomlSequence, outline, parse_lines
from tickrig.host.text.steps import StepError

WORDS = ["080#", "{id}", "705#{id:9}", "stop", "go-on", "forever", "10ms", "0s", "", "5.rpdo1 a=1"]
KEYS = ["send", "wait", "expect", "within", "on-fail", "repeat", "steps", "id", "vars"]

values: st.SearchStrategy[Any] = st.recursive(
    st.sampled_from(WORDS) | st.integers(-2, 3) | st.booleans() | st.floats(allow_nan=False),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=3)
    ),
    max_leaves=6,
)
steps = st.dictionaries(st.sampled_from(KEYS), values, max_size=3)


def toml(value: Any) -> str:
    """Write a value inline."""
    match value:
        case dict():
            return "{" + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(toml, value)) + "]"
        case float():
            return {"Infinity": "inf", "-Infinity": "-inf"}.get(text := json.dumps(value), text)
        case _:
            return json.dumps(value)


def carried_out(text: str) -> None:
    """Read it; if it is one, carry it out for a while."""
    try:
        sequence = TomlSequence(text, "a.toml", {"id": 3}).parse()
    except StepError as error:
        assert re.match(r"a\.toml:\d+: .", str(error))  # noqa: PT017 - either is right
        return
    assert outline(sequence.steps) or not sequence.steps
    run = SequenceRun(sequence)
    for now_us in range(0, 20_000, 1_000):
        run.tick(now_us)


@given(st.lists(steps, max_size=4), values)
def test_any_values_are_steps_or_told_with_their_line(given_steps: list[Any], name: Any) -> None:
    carried_out(f"name = {toml(name)}\nstep = {toml(given_steps)}\n")


@example("step = " + "[" * 10_000)
@given(st.text(max_size=60))
def test_any_text_is_told_with_its_line(text: str) -> None:
    carried_out(text)


@given(st.lists(st.sampled_from(["+1 080#", "+0 123#1", "loop 2", "loop forever", "x", "", "#"])))
def test_any_lines_are_a_sequence_or_told_with_their_number(lines: list[str]) -> None:
    try:
        run = SequenceRun(parse_lines("\n".join(lines), "a.seq"))
    except StepError as error:
        assert re.match(r"a\.seq:\d+: .", str(error))  # noqa: PT017 - either is right
        return
    for now_us in range(0, 20_000, 1_000):
        run.tick(now_us)
