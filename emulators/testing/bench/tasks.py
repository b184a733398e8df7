"""Async bodies of tests: several observations and actions at the same time.

A body awaits times and conditions of the bench. It does not use asyncio, because the loop of
asyncio has its own clock.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Generic, Protocol, TypeVar

from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.sim_waits import Looks
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.host_clock.host_code import HostHangsError, place_of_body
from tickrig.host.text.byte_text import escape
from tickrig.host.text.values import format_time
from tickrig.wire.instant import NEVER

# Conditions: a line or frame, or any function about the bench.

Condition = Callable[[], bool]
"""Function without side effects that returns whether a condition is true."""

_ANY: Final = ""

_ORDINALS: Final = {1: "st", 2: "nd", 3: "rd"}


class LineTrigger:
    """Condition that becomes true when a line or CAN frame has passed a given number of times.

    Args:
        pattern: the whole line, or the frame in candump's notation; `*` stands for anything.
        nth: number of the occurrence, counted from the creation of the condition. The first
            occurrence has the number 1.
        source: name of the wire or device, or empty for any.

    Attributes:
        count: number of occurrences up to now.

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
        """Return whether the line or frame has passed that many times."""
        return self.count >= self._nth

    def __str__(self) -> str:
        """Return a description of the condition.

        >>> str(LineTrigger("OK:*", nth=3))
        'the 3rd OK:*'
        """
        return f"the {_ordinal(self._nth)} {self._text}"

    def hear(self, line: WireLine) -> None:
        """Handle a line of the journal."""
        if self._source in (_ANY, line.source) and line.mark in "<>":
            self.count += self._pattern.fullmatch(escape(line.data)) is not None


def check_condition(condition: object) -> None:
    """Raise TypeError unless an object is a condition that can be called repeatedly."""
    if not callable(condition):
        wanted = 'a function, as lambda: bench.get("state") == "Off", or bench.on_line("OK:*")'
        raise TypeError(f"{condition!r:.60} cannot be waited for: give {wanted}")


def text_of(condition: Condition) -> str:
    """Return a description of a condition for messages.

    The text is the line that the condition waits for, or the file and line number of the function
    that checks the condition.
    """
    if isinstance(condition, LineTrigger):
        return str(condition)
    code = getattr(condition, "__code__", None)
    if code is None:
        return f"a {type(condition).__name__}"
    return f"the condition of {Path(code.co_filename).name}:{code.co_firstlineno}"


def _ordinal(number: int) -> str:
    """Write an ordinal number.

    >>> [_ordinal(number) for number in (1, 2, 3, 4, 11, 22, 112)]
    ['1st', '2nd', '3rd', '4th', '11th', '22nd', '112th']
    """
    teens = number % 100 in (11, 12, 13)
    return f"{number}{'th' if teens else _ORDINALS.get(number % 10, 'th')}"


def when(rig: BenchRig, condition: Condition, act: Callable[[], None]) -> None:
    """Call a function once, when a condition is true for the first time.

    Args:
        rig: rig of the bench.
        condition: function that returns whether the condition is true.
        act: function to call. It is called at once if the condition is already true, otherwise
            after a later step of the rig, between two ticks.
    """

    def watch(now_us: int) -> None:
        if condition():
            rig.rig.watchers.remove(watch)
            act()

    rig.rig.watchers.append(watch)
    watch(rig.rig.now_us)


DAY_US: Final = 86_400_000_000
"""Longest wait of a body in virtual time without a limit."""

_T = TypeVar("_T")

_NO_LOOP: Final = "no running event loop"
"""Message of asyncio without a running loop."""

_WHAT_WAITS: Final = (
    "a bench waits for bench.sleep, bench.until, bench.edge, and for tasks of bench.start,"
    " which run beside the body"
)


@dataclass(frozen=True, slots=True)
class Wait:
    """A wait in an async test: `await Wait(...)` returns whether the condition became true in time.

    Attributes:
        done: function that returns whether the condition is true.
        until_us: time of the bench at which the test continues even if the condition is false.
    """

    done: Callable[[], bool]
    until_us: int = NEVER

    def __await__(self) -> Generator[Wait, bool, bool]:
        """Wait; return whether the condition became true in time."""
        came: bool = yield self
        return came


class _TaskWait(Protocol):
    """An object that advances the time for the body of a test."""

    @property
    def now_us(self) -> int:
        """The time."""
        ...

    def await_until(
        self, done: Callable[[], bool], within_us: int, where: Callable[[], str]
    ) -> bool:
        """Advance the time until a condition is true; return False after the time-out."""
        ...


def run_body(waiting: _TaskWait, body: Coroutine[Any, Any, _T]) -> _T:
    """Run the coroutine of an async test, and advance the time of the bench while it waits.

    Raises:
        TypeError: the coroutine awaits an object that the bench cannot wait for, such as
            `asyncio.sleep`.
        RuntimeError: an awaited condition does not become true within a day of virtual time, or can
            never become true.
        HostHangsError: the limit for waits is reached.
        KeyboardInterrupt: the user has pressed Ctrl-C. The message has the condition and the
            waiting time.
    """
    came: bool | None = None
    while True:
        try:
            wait = _step(body, came)
        except StopIteration as end:
            result: _T = end.value
            return result
        came = _wait(waiting, wait, partial(place_of_body, body))


def _wait(waiting: _TaskWait, wait: Wait, where: Callable[[], str]) -> bool:
    """Advance the time until a condition is true; return False after the time-out."""
    begun_us, for_ever = waiting.now_us, wait.until_us == NEVER
    try:
        came = waiting.await_until(wait.done, max(0, wait.until_us - begun_us), where)
    except KeyboardInterrupt:
        now = format_time(waiting.now_us)
        raise KeyboardInterrupt(f"{now} s old, waiting for {text_of(wait.done)}") from None
    if for_ever and not came:
        if waiting.now_us - begun_us < DAY_US:
            raise RuntimeError("nothing will ever happen for which this body waits")
        what = text_of(wait.done)
        raise RuntimeError(f"{what} did not come in a day of the bench; within= waits longer")
    return came


_NO_TIME: Final = "await bench.sleep of some time"


class Task(Generic[_T]):
    """A coroutine that runs beside a test, always between two ticks of the rig.

    Args:
        rig: rig of the bench.
        body: the coroutine, which must not advance the time itself.
    """

    def __init__(self, rig: BenchRig, body: Coroutine[Any, Any, _T]) -> None:
        self._rig, self._body = rig, body
        self._wait: Wait | None = None
        self._looks = Looks()
        self._result: list[_T] = []
        self._error: BaseException | None = None
        self._raised = False
        rig.rig.watchers.append(self._look)
        self._go_on(None)

    @property
    def done(self) -> bool:
        """Whether the body has ended, with or without an exception."""
        return self._wait is None

    def result(self) -> _T:
        """Return the result of the task's coroutine, or raise the exception of the coroutine.

        Raises:
            RuntimeError: the coroutine has not ended yet, or the task was cancelled.
        """
        __tracebackhide__ = True
        if self._error is not None:
            self._raised = True
            raise self._error
        if not self._result:
            raise RuntimeError(self._why_no_result())
        return self._result[0]

    def _why_no_result(self) -> str:
        if self._wait is None:
            return "the task was cancelled, so it has no result"
        place, done = place_of_body(self._body), self._wait.done
        where = f": it waits at {place}" if place else ""
        what = f" for {done}" if where and isinstance(done, LineTrigger) else ""
        return f"the task has not ended yet{where}{what}"

    def check(self) -> None:
        """Raise the exception of the body, unless the result of the task was read."""
        if self._error is not None and not self._raised:
            self.result()

    def __await__(self) -> Generator[Wait, bool, _T]:
        """Wait for the end of the body."""
        yield Wait(lambda: self.done)
        return self.result()

    def cancel(self) -> None:
        """Cancel the body at its present wait; do nothing if the body has ended."""
        if self._wait is not None:
            self._end()
            self._body.close()

    def _look(self, now_us: int) -> None:
        wait = self._wait
        if wait is not None and ((came := wait.done()) or now_us >= wait.until_us):
            if refusal := self._looks.refusal(now_us, _NO_TIME):
                self._error = HostHangsError(f"{place_of_body(self._body)}: {refusal}")
                self.cancel()
            else:
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
    """Run a body to its next wait; if the body needs the asyncio loop, explain the error."""
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
