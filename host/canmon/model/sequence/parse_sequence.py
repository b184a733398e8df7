"""Sequences as files: TOML with steps that send, wait, expect and repeat, or plain lines."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from tickrig.host.canmon.model.sequence.sequence_run import (
    FrameCondition,
    FrameStep,
    Sequence,
    parse_pattern,
)
from tickrig.host.canmon.model.sequence.variables import fill_in
from tickrig.host.text.steps import FOREVER, Place, StepError, content_lines
from tickrig.host.text.toml_reader import load_toml, read_toml
from tickrig.host.text.values import parse_time_with_unit_us
from tickrig.wire.can import CanFrame
from tickrig.wire.errors import WireError

_LOOP: Final = re.compile(r"loop\s+([0-9]{1,9}|forever)")
_FRAME: Final = re.compile(r"\+([0-9]{1,9}(?:\.[0-9]{1,3})?)\s+(\S+)")


def parse_lines(text: str, file: str) -> Sequence:
    """Read a sequence of lines.

    `+10 123#DEADBEEF` sends a frame 10 ms after the line above; `loop 3` as the first line does
    all of it three times, `loop forever` until it is stopped; `#` begins a comment.

    Raises:
        StepError: `FILE:LINE: what came, what is allowed`.
    """
    steps: list[FrameStep] = []
    times = 1
    for number, content in content_lines(text):
        try:
            if loop := _LOOP.fullmatch(content):
                times = _times(loop[1], first=not steps)
            else:
                steps.append(_line(content, number))
        except (ValueError, WireError) as error:
            raise StepError(f"{file}:{number}: {error}") from None
    if not steps:
        raise StepError(f"{file}:1: no frame, as '+10 123#DEADBEEF'")
    whole = FrameStep(place=(1,), times=times, steps=tuple(steps))
    if times == FOREVER and not whole.takes_time:
        raise StepError(f"{file}:1: loop forever takes no time: write +10 before a frame")
    return Sequence((whole,), partial(_place, file))


def _times(word: str, *, first: bool) -> int:
    if not first:
        raise ValueError("loop stands before the first frame")
    if word == "forever":
        return FOREVER
    if not (times := int(word)):
        raise ValueError("loop takes 1 or more, or forever; got 0")
    return times


def _line(content: str, number: int) -> FrameStep:
    match = _FRAME.fullmatch(content)
    if match is None:
        raise ValueError(f"{content!r} is not '+MS ID#DATA', as '+10 123#DEADBEEF', nor 'loop N'")
    frame = CanFrame.parse(match[2])
    return FrameStep(place=(number,), at_us=round(float(match[1]) * 1_000), what=(frame,))


def _place(file: str, place: Place) -> str:
    return f"{file}:{place[0]}"


KEYS: Final[Mapping[str, tuple[str, ...]]] = {
    "send": (),
    "wait": (),
    "expect": ("within", "on-fail"),
    "repeat": ("steps",),
}
"""What a step does, and what else it may say."""

WITHIN: Final = "1s"
"""How long an expectation waits that does not say."""

_TOP: Final = ("name", "vars", "step")
_LINE: Final = re.compile(r"line ([0-9]+)")  # else it is the end of the document


class _Wrong(Exception):  # noqa: N818 - never leaves this file
    def __init__(self, path: Place, text: str) -> None:
        super().__init__(text)
        self.path = path


class TomlSequence:
    """Reads one file.

    Args:
        text: the file.
        file: its name, for messages.
        variables: values that go before those of `[vars]`.
        resolve: makes a frame of what a step sends, where it is no frame in candump notation.
        condition: makes a condition of what a step expects, where it is no pattern of a frame.
    """

    def __init__(
        self,
        text: str,
        file: str,
        variables: Mapping[str, int] | None = None,
        *,
        resolve: Callable[[str], CanFrame] = CanFrame.parse,
        condition: Callable[[str], FrameCondition] | None = None,
    ) -> None:
        self._text, self._file = text, file
        self._given = dict(variables or {})
        self._resolve = resolve
        self._condition = condition or parse_pattern
        self._variables: dict[str, int] = {}

    def parse(self) -> Sequence:
        """Read it.

        Raises:
            StepError: `FILE:LINE: what came, what is allowed`.
        """
        try:
            top = load_toml(self._text)
        except tomllib.TOMLDecodeError as error:
            raise StepError(self._syntax(str(error))) from None
        try:
            self._variables = {**self._vars(top.get("vars", {})), **self._given}
            _check_keys(top, _TOP, ())
            if not top.get("step"):
                raise _Wrong((), "no [[step]]")
            steps = self._steps(top["step"], ("step",))
        except _Wrong as error:
            raise StepError(f"{self._locate(error.path)}: {error}") from None
        return Sequence(steps, self._locate)

    def _locate(self, place: Place) -> str:
        return f"{self._file}:{read_toml(self._text).line_of(place)}"

    def _syntax(self, text: str) -> str:
        reason, _, place = text.rpartition(" (at ")
        found = _LINE.search(place)
        number = found[1] if found else max(1, len(self._text.splitlines()))
        return f"{self._file}:{number}: {reason or place}"

    def _vars(self, table: Any) -> dict[str, int]:
        if not isinstance(table, dict):
            raise _Wrong(("vars",), f"vars = {table!r} is no table")
        for name, value in table.items():
            if type(value) is not int:
                raise _Wrong(("vars", name), f"{name} = {value!r} is no whole number")
        return table

    def _steps(self, value: Any, path: Place) -> tuple[FrameStep, ...]:
        if not isinstance(value, list) or not all(isinstance(step, dict) for step in value):
            raise _Wrong(path, f"{path[-1]} = {value!r:.60} is no list of steps")
        return tuple(self._step(step, (*path, number)) for number, step in enumerate(value))

    def _step(self, step: dict[str, Any], path: Place) -> FrameStep:
        verbs = [key for key in step if key in KEYS]
        if len(verbs) != 1:
            came = " and ".join(verbs) or ", ".join(step) or "nothing"
            raise _Wrong(path, f"a step has one of {', '.join(KEYS)}; this one has {came}")
        verb = verbs[0]
        _check_keys(step, (verb, *KEYS[verb]), path)
        try:
            return _READERS[verb](self, step, path)
        except (ValueError, WireError) as error:
            raise _Wrong((*path, verb), str(error)) from None

    def _send(self, step: dict[str, Any], path: Place) -> FrameStep:
        return FrameStep(place=path, what=tuple(map(self._frame, _texts(step["send"], "send"))))

    def _frame(self, text: str) -> CanFrame:
        filled = fill_in(text, self._variables)
        return CanFrame.parse(filled) if "#" in filled else self._resolve(filled)

    def _wait(self, step: dict[str, Any], path: Place) -> FrameStep:
        return FrameStep(place=path, at_us=self._time(step["wait"]))

    def _expect(self, step: dict[str, Any], path: Place) -> FrameStep:
        texts = (fill_in(text, self._variables) for text in _texts(step["expect"], "expect"))
        wanted = tuple(
            parse_pattern(text) if "#" in text else self._condition(text) for text in texts
        )
        within_us = self._time(step.get("within", WITHIN))
        if not within_us:
            raise ValueError("within takes a time above 0")
        on_fail = step.get("on-fail", "stop")
        steps: tuple[FrameStep, ...] = ()
        if isinstance(on_fail, list):
            steps = self._steps(on_fail, (*path, "on-fail"))
        elif on_fail not in ("stop", "go-on"):
            raise ValueError(f"on-fail is 'stop', 'go-on' or a list of steps, got {on_fail!r}")
        return FrameStep(
            place=(*path, "expect"),
            wanted=wanted,
            within_us=within_us,
            goes_on=on_fail == "go-on",
            on_fail=steps,
        )

    def _repeat(self, step: dict[str, Any], path: Place) -> FrameStep:
        times = FOREVER if step["repeat"] == "forever" else step["repeat"]
        if type(times) is not int or (times < 1 and step["repeat"] != "forever"):
            raise ValueError(f"repeat takes 1 or more, or 'forever'; got {step['repeat']!r}")
        if "steps" not in step:
            raise ValueError("repeat has no steps")
        steps = self._steps(step["steps"], (*path, "steps"))
        repeat = FrameStep(place=path, times=times, steps=steps)
        if times == FOREVER and not repeat.takes_time:
            raise ValueError("repeat = 'forever' takes no time: add a wait or an expect")
        return repeat

    def _time(self, value: Any) -> int:
        if not isinstance(value, str):
            raise ValueError(f"{value!r} is not a time: write '1.5s', '200ms' or '250us'")
        return parse_time_with_unit_us(value)


_Reader = Callable[[TomlSequence, dict[str, Any], Place], FrameStep]
_READERS: Final[Mapping[str, _Reader]] = {
    "send": TomlSequence._send,
    "wait": TomlSequence._wait,
    "expect": TomlSequence._expect,
    "repeat": TomlSequence._repeat,
}


def _check_keys(table: Mapping[str, Any], known: tuple[str, ...], path: Place) -> None:
    for key in table:
        if key not in known:
            raise _Wrong((*path, key), f"no key {key!r} here; known: {', '.join(known)}")


def _texts(value: Any, key: str) -> list[str]:
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, list) or not texts or not all(isinstance(t, str) for t in texts):
        raise ValueError(f"{key} takes a text or a list of texts, got {value!r:.60}")
    return texts
