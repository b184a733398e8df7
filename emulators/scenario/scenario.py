"""Scenarios: what is done to a device at which time (docs/reference/bench/scenario.md)."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.emulators.bench.fault_spec import FaultSpec, parse_fault_spec
from tickrig.emulators.bench.operator import PRESS_US, Operator
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.host.text.byte_text import unescape
from tickrig.host.text.names import near
from tickrig.host.text.steps import Condition, Step, StepError, content_lines
from tickrig.host.text.values import Setting, parse_setting, parse_time_us

Encoder = Callable[[bytes], bytes]
"""Makes a line for the wire of the text that a scenario gives."""


@dataclass(frozen=True, slots=True)
class Send:
    """Send bytes as the host; `shown` is what the transcript shows."""

    data: bytes
    shown: bytes


Sender = Callable[[str], Send]
"""Reads what stands behind a verb that sends."""


@dataclass(frozen=True, slots=True)
class Set:
    """Set an input or a group."""

    name: str
    values: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class Press:
    """Press a button for a time."""

    name: str
    duration_us: int = PRESS_US


@dataclass(frozen=True, slots=True)
class Release:
    """Let a button go."""

    name: str


@dataclass(frozen=True, slots=True)
class Clear:
    """Let a fault go."""

    name: str


@dataclass(frozen=True, slots=True)
class Watch:
    """Show outputs when they change."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class End:
    """End the run."""


Action = Send | Set | Press | Release | FaultSpec | Clear | Watch | End


ScenarioStep = Step[Action, str]
"""An action at a time, or a line of the device that is wanted from then on."""


class _Wanted(NamedTuple):
    """A line of the device that must come in time; `*` stands for any characters."""

    line: Condition[str]
    within_us: int


_LINE: Final = re.compile(r"(\+?)(\S+)\s+(\w+)(?:\s+(.*))?")
_PRESS: Final = re.compile(r"(\S+)(?:\s+for\s+(\S+))?")
_EXPECT: Final = re.compile(r"(.*\S)\s+within\s+(\S+)")


class ScenarioParser:
    """Reads scenarios for one device; what it lets through can be carried out.

    Args:
        device: for the names of inputs and outputs.
        operator: for what can be done to it.
        encoders: further verbs that send a line, beside `send`.
        senders: the verbs that send, on a wire that carries no lines.
    """

    def __init__(
        self,
        device: HasSignals,
        operator: Operator,
        encoders: Mapping[str, Encoder] | None = None,
        *,
        senders: Mapping[str, Sender] | None = None,
    ) -> None:
        self._device, self._operator = device, operator
        self._verbs: dict[str, Callable[[str], Action | _Wanted]] = {
            **(senders or _line_senders(encoders or {})),
            "set": self._parse_set,
            "press": self._parse_press,
            "release": self._parse_release,
            "fault": self._parse_fault,
            "clear": self._parse_clear,
            "watch": self._parse_watch,
            "expect": _parse_expect,
            "end": _parse_end,
        }

    def parse(self, text: str, file: str) -> tuple[ScenarioStep, ...]:
        """Read a whole scenario.

        Raises:
            StepError: `FILE:LINE: what came, what is allowed`.
        """
        steps: list[ScenarioStep] = []
        for number, content in content_lines(text):
            place = f"{file}:{number}"
            try:
                steps.append(self._parse_line(content, steps[-1:], place))
            except ValueError as error:
                raise StepError(f"{place}: {error}") from None
        return tuple(steps)

    def _parse_line(self, content: str, above: list[ScenarioStep], place: str) -> ScenarioStep:
        match = _LINE.fullmatch(content)
        if match is None:
            raise ValueError(f"{content!r} is not 'TIME ACTION ...', as '1.5s press NAME'")
        plus, time, verb, rest = match.groups()
        before_us = above[0].at_us or 0 if above else 0
        at_us = parse_time_us(time) + (before_us if plus else 0)
        if at_us < before_us:
            raise ValueError(f"{time} is earlier than the action above")
        if above and isinstance(above[0].what, End):
            raise ValueError(f"{verb} comes after end")
        if verb not in self._verbs:
            raise ValueError(f"no action {verb!r}; {near(verb, self._verbs)}")
        action = self._verbs[verb](rest or "")
        if isinstance(action, _Wanted):
            line, within_us = action
            return Step(place=place, at_us=at_us, wanted=(line,), within_us=within_us)
        if isinstance(action, FaultSpec) and action.to_us <= at_us:
            raise ValueError(f"{rest} would have ended before {time}")
        return Step(place=place, at_us=at_us, what=action)

    def _parse_set(self, rest: str) -> Set:
        name, *words = shlex.split(rest) or [""]
        values = tuple(parse_setting(word) for word in words)
        self._operator.check_set(name, *values)
        return Set(name, values)

    def _parse_press(self, rest: str) -> Press:
        match = _PRESS.fullmatch(rest)
        if match is None:
            raise ValueError(f"press takes NAME or NAME for DURATION, got {rest!r}")
        self._operator.check_press(match[1])
        press = Press(match[1], parse_time_us(match[2]) if match[2] else PRESS_US)
        self._operator.check_press(press.name, press.duration_us)
        return press

    def _parse_release(self, rest: str) -> Release:
        self._operator.check_press(rest)
        return Release(rest)

    def _parse_fault(self, rest: str) -> FaultSpec:
        spec = parse_fault_spec(rest, self._operator.check_clear)
        self._operator.check_fault(spec)
        return spec

    def _parse_clear(self, rest: str) -> Clear:
        self._operator.check_clear(rest)
        return Clear(rest)

    def _parse_watch(self, rest: str) -> Watch:
        names, device = tuple(rest.split()), self._device
        for name in names or ("",):
            if name not in device.outputs and name not in device.inputs.table:
                raise ValueError(f"no output {name!r}; {near(name, device.outputs)}")
        return Watch(names)


def _line_senders(encoders: Mapping[str, Encoder]) -> dict[str, Sender]:
    """Return the verbs of a serial line."""
    lines: dict[str, Encoder] = {"send": lambda text: text + b"\n", **encoders}
    return {**{verb: _line_sender(encode) for verb, encode in lines.items()}, "raw": parse_raw}


def _line_sender(encode: Encoder) -> Sender:
    def parse(rest: str) -> Send:
        data = encode(unescape(rest))
        return Send(data, data.removesuffix(b"\n"))

    return parse


def parse_raw(rest: str) -> Send:
    """Read what stands behind `raw`: bytes in hex.

    Raises:
        ValueError: something else.
    """
    try:
        data = bytes.fromhex(rest)
    except ValueError:
        data = b""
    if not data:
        raise ValueError(f"raw takes bytes in hex, as '6f 6b 0a', got {rest!r}")
    return Send(data, data)


def _parse_expect(rest: str) -> _Wanted:
    match = _EXPECT.fullmatch(rest)
    if match is None:
        raise ValueError(f"expect takes TEXT within DURATION, got {rest!r}")
    pattern = re.compile(".*".join(map(re.escape, match[1].split("*"))))
    line = Condition[str](match[1], lambda text: pattern.fullmatch(text) is not None)
    return _Wanted(line, parse_time_us(match[2]))


def _parse_end(rest: str) -> End:
    if rest:
        raise ValueError(f"end takes nothing, got {rest!r}")
    return End()
