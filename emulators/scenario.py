"""Scenarios: timed actions on a device (docs/reference/bench/scenario.md)."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple, assert_never

from tickrig.emulators.bench.operator import PRESS_US, FaultSpec, Operator, parse_fault_spec
from tickrig.emulators.bench.running_emulator import RunningEmulator, Transcript
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.host.text.byte_text import escape, unescape
from tickrig.host.text.names import near
from tickrig.host.text.steps import Condition, Step, StepError, content_lines
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time, parse_setting, parse_time_us

# Scenarios: timed actions on a device (docs/reference/bench/scenario.md).

Encoder = Callable[[bytes], bytes]
"""Function that converts the text in a scenario to a line for the wire."""


@dataclass(frozen=True, slots=True)
class Send:
    """Send bytes as the host. The transcript shows the text `shown`."""

    data: bytes
    shown: bytes


Sender = Callable[[str], Send]
"""Function that reads the argument of a verb that sends."""


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
class _Release:
    """Release a button."""

    name: str


@dataclass(frozen=True, slots=True)
class Clear:
    """Clear a fault."""

    name: str


@dataclass(frozen=True, slots=True)
class _ExpectWatch:
    """Show outputs when they change."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ScenarioEnd:
    """End the run."""


_Action = Send | Set | Press | _Release | FaultSpec | Clear | _ExpectWatch | ScenarioEnd


ScenarioStep = Step[_Action, str]
"""A timed action, or a line of the device expected from then on."""


class _Wanted(NamedTuple):
    """An expected line of the device with a time limit; `*` matches any characters."""

    line: Condition[str]
    within_us: int


_LINE: Final = re.compile(r"(\+?)(\S+)\s+(\w+)(?:\s+(.*))?")
_PRESS: Final = re.compile(r"(\S+)(?:\s+for\s+(\S+))?")
_EXPECT: Final = re.compile(r"(.*\S)\s+within\s+(\S+)")


class ScenarioParser:
    """Parses and checks scenarios, which are timed scripts for one emulated device.

    Args:
        device: device whose inputs and outputs the scenario may name.
        operator: operator of the device, which checks the names and values in actions such as
            `set`, `press` and `fault`.
        encoders: functions of additional verbs that send to the device, by name of the verb. The
            function gets the text after the verb in the scenario, and returns the bytes to send.
        senders: functions of the verbs that send, for a wire that transports no text lines, such as
            a CAN bus. The key is the name of the verb. Each function parses the text after its
            verb. If they are given, the scenario has these verbs instead of `send`, `raw` and the
            verbs of `encoders`.
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
        self._at_us = 0  # of the line that is read
        self._verbs: dict[str, Callable[[str], _Action | _Wanted]] = {
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
        """Parse the whole text of a scenario.

        Args:
            text: content of the scenario file.
            file: name of the file, for error messages.

        Raises:
            StepError: a line is invalid. The message is `FILE:LINE: the text, and what is allowed`.
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
        if above and isinstance(above[0].what, ScenarioEnd):
            raise ValueError(f"{verb} comes after end")
        if verb not in self._verbs:
            raise ValueError(f"no action {verb!r}; {near(verb, self._verbs)}")
        self._at_us = at_us
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

    def _parse_release(self, rest: str) -> _Release:
        self._operator.check_press(rest)
        return _Release(rest)

    def _parse_fault(self, rest: str) -> FaultSpec:
        spec = parse_fault_spec(rest, self._operator.check_clear, self._at_us)
        self._operator.check_fault(spec)
        return spec

    def _parse_clear(self, rest: str) -> Clear:
        self._operator.check_clear(rest)
        return Clear(rest)

    def _parse_watch(self, rest: str) -> _ExpectWatch:
        names, device = tuple(rest.split()), self._device
        for name in names or ("",):
            if name not in device.outputs and name not in device.inputs.table:
                raise ValueError(f"no output {name!r}; {near(name, device.outputs)}")
        return _ExpectWatch(names)


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
    """Parse the argument of the scenario verb `raw`: bytes in hex, such as `6f 6b 0a`.

    Raises:
        ValueError: the text is not bytes in hex.
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


def _parse_end(rest: str) -> ScenarioEnd:
    if rest:
        raise ValueError(f"end takes nothing, got {rest!r}")
    return ScenarioEnd()


# Play a scenario on an emulator.


class ScenarioPlayer:
    """Executes a scenario while the time of its emulator advances.

    Args:
        emulator: emulator, which must not have run yet.
        scenario: steps of the scenario.
        transcript: transcript that receives missed expectations and watched outputs.
        stays: whether the emulator keeps running if the scenario has no `end`.

    Attributes:
        met: number of met expectations.
        missed: number of missed expectations.
    """

    def __init__(
        self,
        emulator: RunningEmulator,
        scenario: Sequence[ScenarioStep],
        transcript: Transcript,
        *,
        stays: bool = False,
    ) -> None:
        self._emulator, self._transcript = emulator, transcript
        self._open: list[ScenarioStep] = []
        self.met = self.missed = 0
        emulator.log.listeners.append(self._hear)
        for step in scenario:
            emulator.event_queue.put(step, step.at_us or 0, partial(self._carry_out, step))
        if not stays and not any(isinstance(step.what, ScenarioEnd) for step in scenario):
            end_us = max(((step.at_us or 0) + step.within_us for step in scenario), default=0)
            emulator.event_queue.put(self, end_us, self._end)

    def finish(self, now_us: int) -> None:
        """Count as missed the expectations that are not met yet."""
        for item in list(self._open):
            self._miss(item, now_us)
            self._emulator.event_queue.drop(item)

    def _carry_out(self, step: ScenarioStep, now_us: int) -> None:
        """Run an action; a refusal by the device counts as missed."""
        try:
            self._do(step, now_us)
        except ValueError as error:
            self.missed += 1
            self._transcript.write(now_us, "?", f"{step.place}: {error}")

    def _do(self, step: ScenarioStep, now_us: int) -> None:
        operator = self._emulator.operator
        match step.what:
            case Send(data, shown):
                self._transcript.send(now_us, data, shown)
            case Set(name, values):
                operator.set(name, *values)
            case Press(name, duration_us):
                operator.press(now_us, name, duration_us)
            case _Release(name):
                operator.release(name)
            case FaultSpec() as spec:
                operator.fault(now_us, spec)
            case Clear(name):
                operator.clear(name)
            case _ExpectWatch(names):
                self._transcript.watch(now_us, *names)
            case None:
                self._open.append(step)
                queue = self._emulator.event_queue
                queue.put(step, now_us + step.within_us, partial(self._miss, step))
            case ScenarioEnd():
                self._end(now_us)
            case _ as never:
                assert_never(never)

    def _hear(self, line: WireLine) -> None:
        text = escape(line.data)
        if line.mark is Mark.FROM_DEVICE:
            for item in [item for item in self._open if item.wanted[0].matches(text)]:
                self._open.remove(item)
                self._emulator.event_queue.drop(item)
                self.met += 1

    def _miss(self, step: ScenarioStep, now_us: int) -> None:
        self._open.remove(step)
        self.missed += 1
        text, since = step.wanted[0].text, format_time(step.at_us or 0)
        within = f"within {step.within_us / 1_000:g} ms of {since}"
        self._transcript.write(now_us, "?", f"{step.place}: no line {text!r} {within}")

    def _end(self, now_us: int) -> None:
        self.finish(now_us)
        self._emulator.stop()
