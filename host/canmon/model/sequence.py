"""Sequences of frames to send and to expect, step by step. The caller passes the time.

The module executes sequences. Conditions of a sequence are frames, given by a pattern or a filter.

>>> from tickrig.wire.can import CanFrame
>>> frames = map(CanFrame.parse, ("585#6041", "585#60F1AA", "585#6042"))
>>> [parse_pattern("585#60?1*").matches(Record(0, "can0", frame)) for frame in frames]
[True, True, False]

>>> fill_in("{0x600+id:3}#2B{index:u16}00", {"id": 3, "index": 0x6040})
'603#2B406000'
>>> fill_in("123#{-2:i16}{id}", {"id": 16}), fill_in("{id}.rpdo1", {"id": 16})
('123#FEFF10', '16.rpdo1')
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.frames import Record
from tickrig.host.text.names import near
from tickrig.host.text.steps import FOREVER, Condition, Place, Step, StepError, content_lines
from tickrig.host.text.toml_reader import read_toml
from tickrig.host.text.values import format_time, parse_time_with_unit_us
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

# Variables in the text of a sequence: `{id}`, `{0x600+id:3}`, `{speed:i16}`, `{n:d}`.


_FIELD: Final = re.compile(r"\{([^{}:]*)(?::([^{}]*))?\}")
_FORM: Final = re.compile(r"([1-8])|([ui])(8|16|24|32|40|48|56|64)|d")
_BINARY: Final[dict[type[ast.operator], Callable[[int, int], int]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
}
_MOST_BITS: Final = 64
_LONGEST: Final = 1_000
"""Maximum number of characters of an expression."""


def fill_in(text: str, variables: Mapping[str, int]) -> str:
    """Replace the fields of a sequence step, such as `{id}` or `{id:3}`, by numbers.

    A text that contains a `#` is a frame. In a frame, a field becomes two hex digits. In any other
    text, a field becomes a decimal number. If a format follows the name in the field, the format
    decides: with `:3`, the field becomes three hex digits, with `:i16` two bytes with the low byte
    first, and with `:d` a decimal number.

    Raises:
        ValueError: a variable is unknown, a value is not a whole number, or a number does not fit.
    """
    usual = "2" if "#" in text else "d"
    return _FIELD.sub(lambda match: _written(match[1], match[2] or usual, variables), text)


def parse_variable(text: str) -> tuple[str, int]:
    """Read `NAME=NUMBER` of a command line. Raise ValueError for other texts."""
    name, _, number = text.partition("=")
    try:
        if not name.isidentifier():
            raise ValueError
        return name, int(number, 0)
    except ValueError:
        raise ValueError(f"{text!r} is not NAME=NUMBER, as id=3 or index=0x6040") from None


def evaluate(text: str, variables: Mapping[str, int]) -> int:
    """Calculate an integer expression of a sequence file, such as `0x600+id`.

    Raises:
        ValueError: the text is not such an expression, or the result has more than 64 bits.
    """
    try:
        if len(text) > _LONGEST:
            raise SyntaxError
        number = _number(ast.parse(text.strip(), mode="eval").body, variables)
    except (SyntaxError, ZeroDivisionError, RecursionError, MemoryError):
        raise ValueError(f"{text!r:.60} is no whole number: write 3, 0x600+id or 2*n") from None
    return number


def _number(node: ast.expr, variables: Mapping[str, int]) -> int:
    match node:
        case ast.Constant(value=int() as value) if not isinstance(value, bool):
            number = value
        case ast.Name(id=name):
            if name not in variables:
                known = ", ".join(variables) or "none; give --var NAME=NUMBER"
                raise ValueError(f"no variable {name!r}; known: {known}")
            number = variables[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            number = -_number(operand, variables)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            number = _BINARY[type(op)](_number(left, variables), _count(right, op, variables))
        case _:
            text = ast.unparse(node)
            raise ValueError(f"{text!r:.60} is no whole number: write 3, 0x600+id or 2*n")
    if abs(number) >> _MOST_BITS:
        raise ValueError(f"{ast.unparse(node)!r} has more than {_MOST_BITS} bits")
    return number


def _count(node: ast.expr, op: ast.operator, variables: Mapping[str, int]) -> int:
    number = _number(node, variables)
    if isinstance(op, ast.LShift | ast.RShift) and not 0 <= number <= _MOST_BITS:
        raise ValueError(f"{ast.unparse(node)!r} is no shift; 0 to {_MOST_BITS} is")
    return number


def _written(text: str, form: str, variables: Mapping[str, int]) -> str:
    number = evaluate(text, variables)
    match = _FORM.fullmatch(form)
    if match is None:
        raise ValueError(f"{{{text}:{form:.20}}}: 1 to 8 hex digits, u8 to u64, i8 to i64, or d")
    digits, sign, bits = match.groups()
    if form == "d":
        return str(number)
    try:
        if digits:
            return _digits(number, int(digits))
        return number.to_bytes(int(bits) // 8, "little", signed=sign == "i").hex().upper()
    except OverflowError:
        raise ValueError(f"{text} = {number} does not fit {form!r}") from None


def _digits(number: int, digits: int) -> str:
    if not 0 <= number < 1 << 4 * digits:
        raise OverflowError
    return f"{number:0{digits}X}"


# Theory of operation
# ===================
#
# A sequence is a tree of steps (host/text/steps.py), read from TOML or from plain lines,
# and a run of it is a generator: it yields a pause and receives whether its condition was met.
# `SequenceRun.tick` takes the time and the frames and returns frames to send; it does not sleep or
# read, so the same run serves `canmon seq`, the screen and tests in virtual time.
#
# Time. Waits count from when the step before was due, not from when `tick` was called, so a
# loop of +10 lines keeps its rate however late the caller is. After an expectation is met, time
# counts from this call, because its frame has no due time. Within one `tick` frames are processed
# before time-outs: a frame that came in time is never missed because the caller was late.
#
# An expectation waits for several frames in any order; each frame meets one condition, the first
# that matches. Frames that this program sent are ignored. Only one pause is open at a time, so
# frames that come while nothing is expected are dropped.
#
# `forever` needs a step that takes time in it, or one tick would never end: both readers
# refuse it.
#
# Places. A step knows its path in the document and not its line; `locate` finds the line on
# request. So messages that are not shown cost nothing.

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f?]{3}|[0-9A-Fa-f?]{8})#(R[0-8]?|(?:[0-9A-Fa-f?]{2}\.?){0,8}\*?)"
)


FrameCondition = Condition[Record]


def parse_pattern(text: str) -> FrameCondition:
    """Parse the pattern of an expected frame. Return a condition that tests received frames.

    The pattern is a frame in candump notation, in which `?` is any hex digit and `*` is any number
    of further bytes.

    Raises:
        ValueError: the text is not such a pattern.
    """
    match = _NOTATION.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"{text!r} is not a frame like 705#05, 585#60??????* or 705#R")
    can_id, data = (part.upper().replace(".", "") for part in match.groups())
    body = data.replace("?", "[0-9A-F]").replace("*", "[0-9A-F]*")
    # `?` may stand in the CAN-ID, too; `*` is any number of digits, which is any number of
    # bytes.
    regex = re.compile(f"{can_id.replace('?', '[0-9A-F]')}#{body}")
    return Condition(text, lambda record: regex.fullmatch(str(record.frame)) is not None)


class DecodedCondition:
    """The latest frame with its meaning, used for the conditions of a sequence."""

    def __init__(self) -> None:
        self._latest: tuple[Record, Decoded] | None = None

    def take(self, record: Record, decoded: Decoded) -> None:
        """Store a frame. The next conditions apply to this frame."""
        self._latest = record, decoded

    def condition(self, text: str) -> FrameCondition:
        """Parse a filter expression. Return a condition that tests decoded frames.

        Raises:
            ValueError: the text is not a filter.
        """
        chosen = parse_filter(text)

        def matches(record: Record) -> bool:
            latest = self._latest
            return latest is not None and latest[0] is record and chosen.matches(*latest)

        return Condition(text, matches)


_FrameStep = Step[Frames, Record]
"""Step that sends frames, waits, expects frames, or repeats other steps."""


@dataclass(frozen=True, slots=True)
class Sequence:
    """A parsed sequence: the steps that `canmon seq` runs, such as frames to send or to expect.

    Attributes:
        steps: steps in order.
        locate: function that returns the position of a step in the file as `FILE:LINE`.
    """

    steps: tuple[_FrameStep, ...]
    locate: Callable[[Place], str]


class EventType(StrEnum):
    """Type of an event."""

    SENT = ">"
    MET = "ok"
    MISSED = "?"
    END = "."


class SequenceEvent(NamedTuple):
    """An event of the execution, with its time."""

    at_us: int
    mark: EventType
    text: str


class _Pause(NamedTuple):
    until_us: int
    conditions: tuple[FrameCondition, ...] = ()


_Play = Generator[_Pause, bool, bool]
"""Generator that yields pauses, receives whether they were met, and returns whether to continue."""


class SequenceRun:
    """One execution of a sequence. The caller calls `tick`, which returns the frames to send.

    A wait counts from the time at which the previous step was due, so that waits do not drift. In
    each call, frames are processed before time-outs.

    Args:
        sequence: sequence to execute.

    Attributes:
        done: whether the sequence has ended.
        met: number of expected frames that arrived in time.
        missed: number of expected frames that did not arrive in time.
        events: events of the execution, such as sent frames. Code that displays the events may
            remove them.
    """

    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self._begun, self._at_us = False, 0
        self._play = self._all(sequence.steps)
        self._pause = _Pause(0)
        self._out: list[CanFrame] = []
        self.done = False
        self.met = self.missed = 0
        self.events: list[SequenceEvent] = []

    @property
    def due_us(self) -> int:
        """Time at which the next call is due, even if no frame arrives."""
        return self._pause.until_us

    def tick(self, now_us: int, records: Iterable[Record] = ()) -> Frames:
        """Process received frames, execute the steps that are due, and return the frames to send.

        Args:
            now_us: current time. The first call starts the sequence.
            records: frames since the previous call. Frames that this program sent are ignored.
        """
        if not self._begun:
            self._begun, self._at_us = True, now_us
            self._resume(now_us, None)
        for one in records:
            if self._pause.conditions and not one.sent:
                self._receive(one, now_us)
        # Several steps may have become due since the last call; each is carried out at its
        # own due time.
        while self.due_us <= now_us:
            self._resume(self._pause.until_us, not self._pause.conditions)
        out, self._out = tuple(self._out), []
        return out

    def _receive(self, record: Record, now_us: int) -> None:
        conditions = self._pause.conditions
        for number, condition in enumerate(conditions):
            if condition.matches(record):
                left = conditions[:number] + conditions[number + 1 :]
                self._pause = _Pause(self._pause.until_us, left)
                if not left:
                    self._resume(now_us, True)
                return

    def _resume(self, at_us: int, met: bool | None) -> None:
        """Continue at a time up to the next pause. None begins the sequence."""
        self._at_us = at_us
        try:
            self._pause = next(self._play) if met is None else self._play.send(met)
        except StopIteration:
            self.done, self._pause = True, _Pause(NEVER)
            self._report(EventType.END, f"{self.met} met, {self.missed} missed")

    def _all(self, steps: tuple[_FrameStep, ...]) -> _Play:
        for step in steps:
            if not (yield from self._one(step)):
                return False
        return True

    def _one(self, step: _FrameStep) -> _Play:
        if step.at_us is not None:
            yield _Pause(self._at_us + step.at_us)
        self._send(step.what or ())
        if step.wanted:
            return (yield from self._expect(step))
        count = 0
        while step.steps and (not step.times or count < step.times):
            if not (yield from self._all(step.steps)):
                return False
            count += 1
        return True

    def _send(self, frames: Frames) -> None:
        self._out += frames
        for frame in frames:
            self._report(EventType.SENT, str(frame))

    def _expect(self, step: _FrameStep) -> _Play:
        wanted = " and ".join(condition.text for condition in step.wanted)
        if (yield _Pause(self._at_us + step.within_us, step.wanted)):
            self.met += 1
            self._report(EventType.MET, wanted)
            return True
        self.missed += 1
        missing = " and ".join(condition.text for condition in self._pause.conditions)
        place = self._sequence.locate(step.place)
        self._report(
            EventType.MISSED, f"{place}: no {missing} within {step.within_us / 1_000:g} ms"
        )
        return (yield from self._all(step.on_fail)) and step.goes_on

    def _report(self, mark: EventType, text: str) -> None:
        self.events.append(SequenceEvent(self._at_us, mark, text))


def event_line(event: SequenceEvent) -> str:
    """Return an event as text, with seconds, mark and description.

    >>> from tickrig.host.canmon.model.sequence import EventType
    >>> event_line(SequenceEvent(4_718, EventType.MET, "703#05"))
    '0.004718 ok 703#05'
    """
    return f"{format_time(event.at_us)} {event.mark} {event.text}"


def outline(steps: tuple[_FrameStep, ...], depth: int = 0) -> list[str]:
    """Return the steps as lines for the user. Repeated steps are indented."""
    lines = []
    for step in steps:
        lines += ["  " * depth + text for text in _step_texts(step)]
        lines += outline(step.steps or step.on_fail, depth + 1)
    return lines


def _step_texts(step: _FrameStep) -> Iterator[str]:
    if step.at_us is not None:
        yield f"wait {step.at_us / 1_000:g} ms"
    if step.what:
        yield "send " + " ".join(map(str, step.what))
    if step.wanted:
        wanted = " and ".join(condition.text for condition in step.wanted)
        then = "go on" if step.goes_on else "stop"
        yield f"expect {wanted} within {step.within_us / 1_000:g} ms, else {then}"
    if step.times is not None:
        yield f"repeat {step.times or 'forever'}"


# Sequences as files: TOML with steps that send, wait, expect and repeat, or plain lines.

_LOOP: Final = re.compile(r"loop\s+([0-9]{1,9}|forever)")
_FRAME: Final = re.compile(r"\+([0-9]{1,9}(?:\.[0-9]{1,3})?)\s+(\S+)")


def parse_lines(text: str, file: str) -> Sequence:
    """Parse a sequence in its line format, in which each line is a delay and a frame.

    `+10 123#DEADBEEF` sends a frame 10 ms after the line above. `loop 3` as the first line runs all
    lines three times, and `loop forever` until the sequence is stopped. `#` begins a comment.

    Raises:
        StepError: a line is invalid. The message begins with the position, `FILE:LINE`.
    """
    steps: list[_FrameStep] = []
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
    whole = _FrameStep(place=(1,), times=times, steps=tuple(steps))
    if times == FOREVER and not whole.takes_time:
        raise StepError(f"{file}:1: loop forever takes no time: write +10 before a frame")
    return Sequence((whole,), lambda place: f"{file}:{place[0]}")


def _times(word: str, *, first: bool) -> int:
    if not first:
        raise ValueError("loop stands before the first frame")
    if word == "forever":
        return FOREVER
    if not (times := int(word)):
        raise ValueError("loop takes 1 or more, or forever; got 0")
    return times


def _line(content: str, number: int) -> _FrameStep:
    match = _FRAME.fullmatch(content)
    if match is None:
        raise ValueError(f"{content!r} is not '+MS ID#DATA', as '+10 123#DEADBEEF', nor 'loop N'")
    frame = CanFrame.parse(match[2])
    return _FrameStep(place=(number,), at_us=round(float(match[1]) * 1_000), what=(frame,))


_WITHIN: Final = "1s"
"""Time limit of an expectation that gives none."""

_TOP: Final = ("name", "vars", "step")


class _Wrong(Exception):  # noqa: N818 - never leaves this file
    def __init__(self, path: Place, text: str) -> None:
        super().__init__(text)
        self.path = path


class TomlSequence:
    """Parser of a sequence in a TOML file, whose steps send, wait, expect and repeat.

    Args:
        text: content of the file.
        file: name of the file for messages.
        variables: values by name, which override those of the table `[vars]` in the file.
        resolve: function that converts the text of a `send` step to a frame. It is used only if the
            text contains no `#`. A text with a `#` is a CAN-ID and data, such as `123#DEADBEEF`.
        condition: function that converts a text of an `expect` step to a condition. It is used only
            if the text contains no `#`. A text with a `#` is a pattern of a frame.
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
        self._document, self._file = read_toml(text), file
        self._given = dict(variables or {})
        self._resolve = resolve
        self._condition = condition or parse_pattern
        self._variables: dict[str, int] = {}

    def parse(self) -> Sequence:
        """Parse the file, and return the sequence.

        Raises:
            StepError: the file is invalid. The message begins with the position, `FILE:LINE`.
        """
        top = self._document.values
        for line, reason in self._document.mistakes:
            raise StepError(f"{self._file}:{line}: {reason}")
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
        return f"{self._file}:{self._document.line_of(place)}"

    def _vars(self, table: Any) -> dict[str, int]:
        if not isinstance(table, dict):
            raise _Wrong(("vars",), f"vars = {table!r} is no table")
        for name, value in table.items():
            if type(value) is not int:
                raise _Wrong(("vars", name), f"{name} = {value!r} is no whole number")
        return table

    def _steps(self, value: Any, path: Place) -> tuple[_FrameStep, ...]:
        if not isinstance(value, list) or not all(isinstance(step, dict) for step in value):
            raise _Wrong(path, f"{path[-1]} = {value!r:.60} is no list of steps")
        return tuple(self._step(step, (*path, number)) for number, step in enumerate(value))

    def _step(self, step: dict[str, Any], path: Place) -> _FrameStep:
        verbs = [key for key in step if key in _VERBS]
        if len(verbs) != 1:
            came = " and ".join(verbs) or ", ".join(step) or "nothing"
            raise _Wrong(path, f"a step has one of {', '.join(_VERBS)}; this one has {came}")
        verb = verbs[0]
        read, keys = _VERBS[verb]
        _check_keys(step, (verb, *keys), path)
        try:
            return read(self, step, path)
        except (ValueError, WireError) as error:
            raise _Wrong((*path, verb), str(error)) from None

    def _send(self, step: dict[str, Any], path: Place) -> _FrameStep:
        return _FrameStep(place=path, what=tuple(map(self._frame, _texts(step["send"], "send"))))

    def _frame(self, text: str) -> CanFrame:
        filled = fill_in(text, self._variables)
        return CanFrame.parse(filled) if "#" in filled else self._resolve(filled)

    def _wait(self, step: dict[str, Any], path: Place) -> _FrameStep:
        return _FrameStep(place=path, at_us=self._time(step["wait"]))

    def _expect(self, step: dict[str, Any], path: Place) -> _FrameStep:
        texts = (fill_in(text, self._variables) for text in _texts(step["expect"], "expect"))
        wanted = tuple(
            parse_pattern(text) if "#" in text else self._condition(text) for text in texts
        )
        within_us = self._time(step.get("within", _WITHIN))
        if not within_us:
            raise ValueError("within takes a time above 0")
        on_fail = step.get("on-fail", "stop")
        steps: tuple[_FrameStep, ...] = ()
        if isinstance(on_fail, list):
            steps = self._steps(on_fail, (*path, "on-fail"))
        elif on_fail not in ("stop", "go-on"):
            raise ValueError(f"on-fail is 'stop', 'go-on' or a list of steps, got {on_fail!r}")
        return _FrameStep(
            place=(*path, "expect"),
            wanted=wanted,
            within_us=within_us,
            goes_on=on_fail == "go-on",
            on_fail=steps,
        )

    def _repeat(self, step: dict[str, Any], path: Place) -> _FrameStep:
        times = FOREVER if step["repeat"] == "forever" else step["repeat"]
        if type(times) is not int or (times < 1 and step["repeat"] != "forever"):
            raise ValueError(f"repeat takes 1 or more, or 'forever'; got {step['repeat']!r}")
        if "steps" not in step:
            raise ValueError("repeat has no steps")
        steps = self._steps(step["steps"], (*path, "steps"))
        repeat = _FrameStep(place=path, times=times, steps=steps)
        if times == FOREVER and not repeat.takes_time:
            raise ValueError("repeat = 'forever' takes no time: add a wait or an expect")
        return repeat

    def _time(self, value: Any) -> int:
        if not isinstance(value, str):
            raise ValueError(f"{value!r} is not a time: write '1.5s', '200ms' or '250us'")
        return parse_time_with_unit_us(value)


_Reader = Callable[[TomlSequence, dict[str, Any], Place], _FrameStep]
_VERBS: Final[Mapping[str, tuple[_Reader, tuple[str, ...]]]] = {
    "send": (TomlSequence._send, ()),
    "wait": (TomlSequence._wait, ()),
    "expect": (TomlSequence._expect, ("within", "on-fail")),
    "repeat": (TomlSequence._repeat, ("steps",)),
}
"""Readers of the kinds of steps, and the further keys that each kind allows."""


def _check_keys(table: Mapping[str, Any], known: tuple[str, ...], path: Place) -> None:
    for key in table:
        if key not in known:
            raise _Wrong((*path, key), f"no key {key!r} here; {near(key, known)}")


def _texts(value: Any, key: str) -> list[str]:
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, list) or not texts or not all(isinstance(t, str) for t in texts):
        raise ValueError(f"{key} takes a text or a list of texts, got {value!r:.60}")
    return texts
