"""Async bodies of tests: several things that are watched and done at the same time.

A body awaits times and conditions of the bench; nothing here knows asyncio, whose loop has a
clock of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, Protocol, TypeVar

from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.host.text.byte_text import escape
from tickrig.host.text.values import format_time
from tickrig.wire.instant import NEVER

# What something may wait for: a line or frame that passes, or any question about the bench.

Condition = Callable[[], bool]
"""Says whether something is so; it only looks."""

_ANY: Final = ""

_ORDINALS: Final = {1: "st", 2: "nd", 3: "rd"}


class LineTrigger:
    """True from the moment at which a line or frame has passed so often.

    Args:
        pattern: the whole line, or the frame in candump's notation; `*` stands for anything.
        nth: the how manieth from now on, from 1.
        source: the wire or device; any if empty.

    Attributes:
        count: how many have passed.

    Raises:
        ValueError: `nth` is less than 1.
    """

    def __init__(self, pattern: str, nth: int = 1, source: str = _ANY) -> None:
        if nth < 1:
            raise ValueError(f"nth counts from 1, got {nth}")
        self._text = pattern
        self._pattern = re.compile(".*".join(map(re.escape, pattern.split("*"))), re.DOTALL)
        self._nth, self._source, self.count = nth, source, 0

    def __call__(self) -> bool:
        """Return whether it has passed so often."""
        return self.count >= self._nth

    def __str__(self) -> str:
        """Say what it waits for.

        >>> str(LineTrigger("OK:*", nth=3))
        'the 3rd OK:*'
        """
        return f"the {_ordinal(self._nth)} {self._text}"

    def hear(self, line: WireLine) -> None:
        """Take a line of the journal."""
        if self._source in (_ANY, line.source) and line.mark in "<>":
            self.count += self._pattern.fullmatch(escape(line.data)) is not None


def check_condition(condition: object) -> None:
    """Raise TypeError unless something can be asked again and again."""
    if not callable(condition):
        wanted = 'a function, as lambda: bench.get("state") == "Off", or bench.on_line("OK:*")'
        raise TypeError(f"{condition!r:.60} cannot be waited for: give {wanted}")


def text_of(condition: Condition) -> str:
    """Say what somebody waits for: a line, or where the question stands."""
    if isinstance(condition, LineTrigger):
        return str(condition)
    code = getattr(condition, "__code__", None)
    if code is None:
        return f"a {type(condition).__name__}"
    return f"the condition of {Path(code.co_filename).name}:{code.co_firstlineno}"


def _ordinal(number: int) -> str:
    """Write a number as people count.

    >>> [_ordinal(number) for number in (1, 2, 3, 4, 11, 22, 112)]
    ['1st', '2nd', '3rd', '4th', '11th', '22nd', '112th']
    """
    teens = number % 100 in (11, 12, 13)
    return f"{number}{'th' if teens else _ORDINALS.get(number % 10, 'th')}"


def when(rig: BenchRig, condition: Condition, act: Callable[[], None]) -> None:
    """Act once, between two ticks, as soon as something is so: now, or after a later step."""

    def watch(now_us: int) -> None:
        if condition():
            rig.rig.watchers.remove(watch)
            act()

    rig.rig.watchers.append(watch)
    watch(rig.rig.now_us)


DAY_US: Final = 86_400_000_000
"""In virtual time a body that does not say for how long it waits has waited in vain then."""

T = TypeVar("T")

_NO_LOOP: Final = "no running event loop"
"""What asyncio says where there is none."""

_WHAT_WAITS: Final = (
    "a bench waits for bench.sleep, bench.until, bench.edge, and for tasks of bench.start,"
    " which run beside the body"
)


@dataclass(frozen=True, slots=True)
class Wait:
    """What a body waits for.

    Attributes:
        done: says whether it is so.
        until_us: when it goes on even if it is not.
    """

    done: Callable[[], bool]
    until_us: int = NEVER

    def __await__(self) -> Generator[Wait, bool, bool]:
        """Wait; return whether it came to be so in time."""
        came: bool = yield self
        return came


class TaskWait(Protocol):
    """Whoever lets time pass for the body of a test."""

    @property
    def now_us(self) -> int:
        """The time."""
        ...

    def wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        """Let time pass until something is so; False if it was not in time."""
        ...


def run_body(waiting: TaskWait, body: Coroutine[Any, Any, T]) -> T:
    """Run the body of a test: time passes while it waits.

    Raises:
        TypeError: it awaits something else, such as `asyncio.sleep`.
        RuntimeError: what it waits for never comes, or not within a day of virtual time.
        KeyboardInterrupt: Ctrl-C; the text says what it waits for, and how long.
    """
    came: bool | None = None
    while True:
        try:
            wait = _step(body, came)
        except StopIteration as end:
            result: T = end.value
            return result
        came = _wait(waiting, wait)


def _wait(waiting: TaskWait, wait: Wait) -> bool:
    """Let time pass until something is so; False if it was not in time."""
    begun_us, for_ever = waiting.now_us, wait.until_us == NEVER
    try:
        came = waiting.wait_until(wait.done, max(0, wait.until_us - begun_us))
    except KeyboardInterrupt:
        now = format_time(waiting.now_us)
        raise KeyboardInterrupt(f"{now} s old, waiting for {text_of(wait.done)}") from None
    if for_ever and not came:
        if waiting.now_us - begun_us < DAY_US:
            raise RuntimeError("nothing will ever happen for which this body waits")
        what = text_of(wait.done)
        raise RuntimeError(f"{what} did not come in a day of the bench; within= waits longer")
    return came


class Task(Generic[T]):
    """A body that runs beside the test, between two ticks, whoever makes time pass.

    Args:
        rig: the rig whose time it waits in.
        body: what it does; it must not make time pass itself.
    """

    def __init__(self, rig: BenchRig, body: Coroutine[Any, Any, T]) -> None:
        self._rig, self._body = rig, body
        self._wait: Wait | None = None
        self._result: list[T] = []
        self._error: BaseException | None = None
        self._raised = False
        rig.rig.watchers.append(self._look)
        self._go_on(None)

    @property
    def done(self) -> bool:
        """Whether it has ended, in whatever way."""
        return self._wait is None

    def result(self) -> T:
        """Return what it returned, or raise what it raised.

        Raises:
            RuntimeError: it has not ended yet.
        """
        if self._error is not None:
            self._raised = True
            raise self._error
        if not self._result:
            raise RuntimeError("the task has not ended yet")
        return self._result[0]

    def check(self) -> None:
        """Raise what it raised, unless somebody has asked for its result."""
        if self._error is not None and not self._raised:
            self.result()

    def __await__(self) -> Generator[Wait, bool, T]:
        """Wait for its end."""
        yield Wait(lambda: self.done)
        return self.result()

    def cancel(self) -> None:
        """End it where it waits; one that has ended is no error."""
        if self._wait is not None:
            self._end()
            self._body.close()

    def _look(self, now_us: int) -> None:
        wait = self._wait
        if wait is not None and ((came := wait.done()) or now_us >= wait.until_us):
            self._go_on(came)

    def _go_on(self, came: bool | None) -> None:
        try:
            self._wait = _step(self._body, came)
        except StopIteration as end:
            self._result = [end.value]
            self._end()
        except BaseException as error:  # raised where its result is asked for
            self._error = error
            self._end()
        else:
            if self._wait.until_us < NEVER:
                self._rig.event_queue.wake(("task", id(self)), self._wait.until_us)

    def _end(self) -> None:
        self._wait = None
        self._rig.event_queue.drop(("task", id(self)))
        self._rig.rig.watchers.remove(self._look)


def _step(body: Coroutine[Any, Any, Any], came: bool | None) -> Wait:
    """Let a body run to its next wait; one that asks for the loop of asyncio is told what to do."""
    try:
        return _wait_of(body.send(came))
    except RuntimeError as error:
        if error.args == (_NO_LOOP,):
            error.args = (f"{_NO_LOOP}: asyncio has none here; {_WHAT_WAITS}",)
        raise


def _wait_of(wait: object) -> Wait:
    if not isinstance(wait, Wait):
        raise TypeError(f"{_WHAT_WAITS}; not for {wait!r:.60}")
    return wait
