"""Calls from peers, executed at each tick without waking the manager's thread."""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final, TypeVar

from tickrig.host.links.ready import ready
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER

# Calls of other threads, executed in the thread of the manager: no other thread may touch it.

_R = TypeVar("_R")

CALL_TIMEOUT_US: Final = 1_000_000
_LOG: Final = log_of(__name__)

_Entry = tuple[Future[Any] | None, Callable[[], Any]]


class CallQueue:
    """Queue of calls that other threads want the manager's thread to execute.

    Only the manager's thread may access a manager. So other threads put their calls into this
    queue. The manager's thread executes the calls while it waits for its next tick. You set this up
    in one of two ways:

    - With a `ServingClock`, set the attribute `serve` of the clock to the method `serve` of the
      queue.
    - With a `LineServer` (the server of a control socket), call `server.attach(queue, queue.make)`.
    """

    def __init__(self) -> None:
        self._lock, self._entries, self._closed = threading.Lock(), list[_Entry](), False
        self._owner = threading.get_ident()
        self._reader, self._writer = socket.socketpair()
        self._reader.setblocking(False)

    def fileno(self) -> int:
        """Return a file descriptor that is readable while calls wait, or -1 after `close`."""
        return self._reader.fileno()

    def call(self, function: Callable[[], _R], timeout_us: int = CALL_TIMEOUT_US) -> _R:
        """Call a function in the manager's thread, and wait for its result.

        If the caller is already in that thread, the function is called at once.

        Args:
            function: function to call, which must not wait.
            timeout_us: longest time in us until the call begins.

        Returns:
            The result of the function.

        Raises:
            TimeoutError: the call did not begin in time. The function will not be called later.
            RtcRefused: the system has ended.
            Exception: the function raised an exception.
        """
        if threading.get_ident() == self._owner:
            return function()
        future: Future[_R] = Future()
        wait_s = timeout_us / 1e6
        self._enter((future, function))
        try:
            return future.result(wait_s)
        except TimeoutError:
            if not future.cancel():  # it is being made, or has raised this itself
                return future.result()
        raise TimeoutError(f"the system did not begin the call within {wait_s:g} s")

    def post(self, function: Callable[[], object]) -> None:
        """Schedule a call of a function in the manager's thread, without waiting for its result.

        An exception of the function is logged.

        Raises:
            RtcRefused: the system has ended.
        """
        self._enter((None, function))

    def make(self) -> None:
        """Execute the waiting calls. Calls added during this time wait for the next `make`."""
        self._owner = threading.get_ident()
        for future, function in self._taken():
            if future is None:
                _logged(function)
            elif future.set_running_or_notify_cancel():
                _fulfil(future, function)

    def serve(self, wait_us: int) -> None:
        """Execute the waiting calls of other threads. If there are none, wait for the first one.

        Args:
            wait_us: longest wait in us.
        """
        wait_s = max(0, wait_us) / 1e6
        if self._closed:
            time.sleep(wait_s)
        elif ready([self], wait_s=wait_s)[0]:
            self.make()

    def close(self) -> None:
        """Refuse the waiting calls, and all further calls."""
        with self._lock:
            was_closed, self._closed = self._closed, True
        if was_closed:
            return
        for future, _ in self._taken():
            if future is not None and future.set_running_or_notify_cancel():
                future.set_exception(_ended())
        self._reader.close()
        self._writer.close()

    def _enter(self, entry: _Entry) -> None:
        with self._lock:
            if self._closed:
                raise _ended()
            self._entries.append(entry)
            if len(self._entries) == 1:
                self._writer.send(b"\0")

    def _taken(self) -> list[_Entry]:
        with self._lock:
            entries, self._entries = self._entries, []
            if entries:
                self._reader.recv(1)
        return entries


def _ended() -> RtcRefused:
    return RtcRefused("the system has ended", ReturnCode.PRECONDITION_NOT_MET)


def _logged(function: Callable[[], object]) -> None:
    try:
        function()
    except Exception:  # the caller is gone; continue with the others
        _LOG.exception("a call from another thread raised")


def _fulfil(future: Future[_R], function: Callable[[], _R]) -> None:
    try:
        future.set_result(function())
    except BaseException as error:
        future.set_exception(error)
        if not isinstance(error, Exception):
            raise


class Arrivals:
    """Queue of values received by other threads, which are processed at the start of the next tick.

    No code reads a value before the next tick. Therefore an arriving value does not wake the
    manager's thread. This saves processor time. The queue is an item of a `Schedule`, which
    processes the queue in each tick.

    Attributes:
        due_us: always `NEVER`, because the queue requests no tick. The values wait for a tick that
            is due for another reason.
    """

    due_us: Final = NEVER

    def __init__(self) -> None:
        self._calls: deque[Callable[[], object]] = deque()

    def post(self, call: Callable[[], object]) -> None:
        """Schedule a call, in any thread."""
        self._calls.append(call)

    def tick(self, now_us: int, /) -> None:
        """Execute the waiting calls, and those added during this time."""
        while self._calls:
            self._calls.popleft()()
