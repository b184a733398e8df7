"""Event loops of asyncio in the time of a rig."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from math import ceil
from selectors import SelectorKey
from threading import get_ident
from typing import Any, Final, TypeVar, TypeVarTuple

from tickrig.emulators.rig.sim_waits import EPOCH_S, Passing
from tickrig.emulators.testing.host_clock.host_code import (
    HostHangsError,
    HostTimeError,
    place_of_body,
)

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")

_EXECUTOR_S: Final = 5.0
"""Longest real time for which a loop waits for a function in a thread."""

_MOST_SPINS: Final = 1 << 20
"""How often a loop may run at one instant; it takes some seconds."""

_Events = list[tuple[SelectorKey, int]]


class _BenchLoop(asyncio.SelectorEventLoop):
    """An event loop that uses the time of a rig.

    Instead of waiting for its next timer, the loop advances the time. Then it handles events of
    files, sockets and other threads, without waiting for them.

    Args:
        passing: the object whose time advances.
    """

    def __init__(self, passing: Passing) -> None:
        self._passing = passing
        self._threads: ThreadPoolExecutor | None = None
        super().__init__(_PassingSelector(passing, self._called, self._places))
        self._clock_resolution = 1e-6  # of the rig, not of this machine

    def time(self) -> float:
        """Return the time in seconds."""
        return self._passing.time_s

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts
    ) -> asyncio.Future[_T]:
        """Run a function in a thread, and wait for it without advancing the virtual time.

        Args:
            executor: executor as in asyncio, or None for the default.
            func: function to run.
            args: arguments of the function.
        """
        if executor is None:
            if self._threads is None:
                self._threads = ThreadPoolExecutor(thread_name_prefix="asyncio")
            executor = self._threads
        running = executor.submit(func, *args)
        wait([running], _EXECUTOR_S)
        return asyncio.wrap_future(running, loop=self)

    def close(self) -> None:
        """Close the loop, and end its threads."""
        if self._threads is not None:
            self._threads.shutdown(wait=False)
        super().close()

    def _places(self) -> str:
        """Return the lines at which its tasks wait."""
        places = {place_of_body(task.get_coro()) for task in asyncio.all_tasks(self)}
        return ", ".join(sorted(places - {""}))

    def _called(self) -> bool:
        """Return whether a callback is due at once."""
        ready: object = vars(self).get("_ready")
        return bool(ready)


@contextmanager
def bench_loops(passing: Passing) -> Iterator[None]:
    """Make asyncio create event loops that use the virtual time of a rig, during a `with` block.

    Therefore a host may call `asyncio.run`, and its waits take virtual time.

    Args:
        passing: object that advances the time when a loop waits. Only loops of the calling thread
            use it.
    """
    owner, original = get_ident(), asyncio.events.new_event_loop

    def new_event_loop() -> asyncio.AbstractEventLoop:
        return _BenchLoop(passing) if get_ident() == owner else original()

    asyncio.events.new_event_loop = asyncio.new_event_loop = new_event_loop
    try:
        yield
    finally:
        asyncio.events.new_event_loop = asyncio.new_event_loop = original


class _PassingSelector(selectors.BaseSelector):
    """A selector that advances the time of a rig instead of waiting."""

    def __init__(
        self, passing: Passing, called: Callable[[], bool], places: Callable[[], str]
    ) -> None:
        self._passing, self._called, self._places = passing, called, places
        self._spins, self._time_s = 0, passing.time_s
        self._inner = selectors.DefaultSelector()

    def register(self, fileobj: Any, events: int, data: Any = None) -> SelectorKey:
        return self._inner.register(fileobj, events, data)

    def unregister(self, fileobj: Any) -> SelectorKey:
        return self._inner.unregister(fileobj)

    def modify(self, fileobj: Any, events: int, data: Any = None) -> SelectorKey:
        return self._inner.modify(fileobj, events, data)

    def get_map(self) -> Mapping[Any, SelectorKey]:
        return self._inner.get_map()

    def close(self) -> None:
        self._inner.close()

    def select(self, timeout: float | None = None) -> _Events:
        """Return ready events, after advancing the time to the first event or the timeout."""
        found: _Events = self._inner.select(0)

        def come() -> bool:
            found[:] = self._inner.select(0)
            return bool(found) or self._called()

        if found or (timeout is not None and timeout <= 0):
            self._spins += 1
            if self._spins >= _MOST_SPINS:
                self._check_time()
            return found
        timeout_s = None if timeout is None else ceil(timeout * 1e6) / 1e6
        if not self._passing.wait(come, timeout_s) and timeout is None:
            raise HostTimeError(
                "an event loop waits endlessly: nothing that happens on the bench ends it, and"
                " neither threads nor sockets are waited for in virtual time"
            )
        return found

    def _check_time(self) -> None:
        """Raise HostHangsError if no time has passed since the last call."""
        before_s, self._time_s = self._time_s, self._passing.time_s
        spins, self._spins = self._spins, 0
        if self._time_s == before_s:
            raise HostHangsError(
                f"{self._places() or 'an event loop'}: the event loop has run {spins} times at"
                f" {self._time_s - EPOCH_S:.6f} s: asyncio.sleep(0) makes no time pass; sleep for"
                " some time"
            )
