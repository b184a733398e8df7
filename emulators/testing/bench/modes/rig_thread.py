"""A rig in real time, in a thread of its own, and what others have done to it there."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from queue import Empty
from typing import Any, Final, TypeVar

from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.testing.bench.errors import BenchError
from tickrig.host.control.clock import ServingClock
from tickrig.host.links.ready import WaitingQueue

T = TypeVar("T")

_JOIN_S: Final = 10.0
"""A step that has not ended by then never will."""


class RigThread:
    """Runs an emulator; between two of its ticks it does what other threads ask for.

    Before `start` and after its end time stands still, and callers do it themselves. What a
    device raised ends it; that is raised once, in whoever asks for something next, or stops it.

    Args:
        emulator: what is run.
        clock: its clock, which waits here.
    """

    def __init__(self, emulator: RunningEmulator, clock: ServingClock) -> None:
        self._emulator, self._calls = emulator, WaitingQueue[Callable[[], None]]()
        self._lock, self._awaited = threading.Lock(), set[Future[Any]]()
        self._thread: threading.Thread | None = None
        self._error: BaseException | None = None
        self._stopping = self._ended = False
        clock.serve = self._serve

    @property
    def here(self) -> bool:
        """Whether the caller is in this thread."""
        return threading.current_thread() is self._thread

    @property
    def running(self) -> bool:
        """Whether time passes."""
        return self._thread is not None and not self._ended

    def start(self) -> None:
        """Let time pass; it begins once."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="tickrig bench", daemon=True)
            self._thread.start()

    def call(self, do: Callable[[], T]) -> T:
        """Do something between two ticks; return its result, or raise what it raises."""
        if not self.here and (future := self._await()):
            self._calls.put(partial(_settle, future, do))
            result: T = self._result(future)
            return result
        return do()

    def wait_until(self, done: Callable[[], bool], until_us: int) -> bool:
        """Wait until something is so, looking after each step.

        Args:
            done: is asked in this thread; what it raises is raised in the caller's.
            until_us: the first step at or after this time is the last, in the time of the rig.

        Returns:
            False if it was not so by then.

        Raises:
            BenchError: no time passes, or the caller is in this thread.
        """
        if self.here:
            raise BenchError("what is asked between two ticks cannot wait: no time passes there")
        if (future := self._await()) is None:
            raise BenchError("the bench is closed: no time passes")
        self._calls.put(partial(self._watch, future, done, until_us))
        return bool(self._result(future))

    def stop(self) -> None:
        """Let time stand still."""
        if self._thread is not None:
            self._calls.put(self._note_stop)
            self._thread.join(_JOIN_S)
            if self._thread.is_alive():
                raise BenchError(f"a step of the rig has not ended for {_JOIN_S:g} s")
        self._raise_error()

    def _await(self) -> Future[Any] | None:
        """Return what this thread will settle, None if time stands still."""
        with self._lock:
            if self.running:
                future: Future[Any] = Future()
                self._awaited.add(future)
                return future
        self._raise_error()
        return None

    def _result(self, future: Future[T]) -> T:
        try:
            if (error := future.exception()) is not None:
                raise error  # without the frames of `result`
            return future.result()
        finally:
            self._awaited.discard(future)

    def _raise_error(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _watch(self, future: Future[bool], done: Callable[[], bool], until_us: int) -> None:
        """Look now and after each step, until there is an answer."""
        rig = self._emulator.rig

        def look(now_us: int) -> None:
            try:
                answer = True if done() else False if now_us >= until_us else None
            except BaseException as error:
                future.set_exception(error)
            else:
                if answer is None:
                    return
                future.set_result(answer)
            rig.watchers.remove(look)

        rig.watchers.append(look)
        look(rig.now_us)

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._emulator.step()
        except BaseException as error:
            self._error = error
        with self._lock:
            self._ended = True
        for future in tuple(self._awaited):
            if not future.done():
                future.set_exception(self._error or BenchError("the bench was closed meanwhile"))
                self._error = None

    def _serve(self, wait_us: int) -> None:
        """Do one thing that was asked for, within a time."""
        with suppress(Empty):
            self._calls.get(wait_us / 1e6)()

    def _note_stop(self) -> None:
        self._stopping = True


def _settle(future: Future[T], do: Callable[[], T]) -> None:
    """Give a future what comes of something."""
    try:
        future.set_result(do())
    except BaseException as error:
        future.set_exception(error)
