"""Hosts that call `time.sleep` and `time.monotonic`, in the time of a rig."""

from __future__ import annotations

import queue
import select
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.emulators.rig.sim_waits import LOOK_US, Passing, SimTime
from tickrig.emulators.testing.host_clock import host_code
from tickrig.emulators.testing.host_clock import host_code as patches

if TYPE_CHECKING:
    from tickrig.emulators.testing.host_clock import bench_loop
else:
    bench_loop = LazyModule("tickrig.emulators.testing.host_clock.bench_loop")  # imports asyncio

# Replacements for functions that read the time or wait.

# Theory of operation
# ===================
#
# A host that calls `time.sleep` runs in the time of a rig. Three things are needed for this, and
# this folder has all three:
#
# - The functions of the clock are replaced wherever a host's code may have stored them (`Patches`
#   in host_code.py).
# - Each call is checked: its caller decides whether it is a host's (`is_host` in host_code.py).
# - Functions that wait advance the time of the rig (this file, and bench_loop.py for asyncio).
#
# The rules are:
#
# - Which code is host code. All code except Python itself, pytest and similar tools, our own
#   packages, and the three libraries that use our objects on the rig. A patch checks the frame that
#   calls it. The standard library under a host (queue, threading) therefore keeps the machine's
#   clock. Its waits are patched at their own functions (`Event.wait`, `Queue.get`, ...), not at its
#   calls of `time`.
# - Which thread. Only the owner, the thread that patches, advances the time. Threads that ran
#   before keep real time. A thread that a host starts may read the clock, which stands still for
#   this thread. If such a thread waits, the wait is refused: two threads that both drive one rig
#   could not be repeated.
# - A read of the clock takes 100 us of virtual time (`LOOK_US`), a sleep at least as much.
#   Otherwise a loop that only polls the clock would never end.
# - A wait without a timeout ends when the rig makes its condition true. If nothing on the bench can
#   do that, the wait is refused (`_ForEver`), so that the test does not hang.
# - Refusals are raised where they occur and again at the end, because hosts catch exceptions.
#
# `_wait_condition` does what `threading.Condition.wait` does with its waiter locks, by names that
# begin with an underscore. It must leave the condition exactly as CPython does, or `notify` of a
# host wakes no thread. Check it with each new version of Python.
#
# The order at the end matters. Patches are removed in the reverse order. A patch is switched off
# before the original is restored. A place that other code has changed is left unchanged.

_FOR_EVER: Final = (
    "waits endlessly: nothing that happens on the bench ends it, and another thread cannot"
)


_OTHER_CLOCKS: Final = {
    "freezegun": ("freezegun.api", ("freeze_factories",)),
    "time-machine": ("time_machine", ("traveller_stack", "coordinates_stack")),
}
"""Packages that replace the clock, and the name of the replacement in each package."""


def _check_clock() -> None:
    """Raise HostTimeError if freezegun or time-machine has replaced the clock.

    Both packages change `datetime` and `time`. In freezegun `monotonic` is frozen, so a host that
    polls until a deadline never reaches the deadline.
    """
    for package, (module, stacks) in _OTHER_CLOCKS.items():
        if (found := sys.modules.get(module)) and any(getattr(found, s, None) for s in stacks):
            raise host_code.HostTimeError(
                f"{package} has replaced the clock, and so does bench_time (bench.patched_time):"
                " use one of them; bench_time begins at 2000-01-01 and moves datetime not at all"
            )


def _line_of(frame: FrameType) -> str:
    """Return the running file and line as text for messages."""
    return host_code.place_of(frame.f_code.co_filename, frame.f_lineno)


class _ClockWaits:
    """Replacements for waiting functions.

    Args:
        passing: the object whose time advances.
        clock: functions of `time` in the time of the rig.

    Attributes:
        refusals: refused waits in another thread, or in a callback of the rig.
    """

    def __init__(self, passing: Passing, clock: SimTime) -> None:
        self._passing, self._clock = passing, clock
        self.refusals: list[str] = []
        self._standing = SimTime(_Standing(passing))
        self._owner = threading.get_ident()
        self._others = {thread.ident for thread in threading.enumerate()} - {self._owner}

    def acts(self) -> patches.Acts:
        """Return all replacements."""
        return {
            **{(time, name): self._look(name) for name in patches.LOOKS},
            (time, "sleep"): self._waiting("time.sleep", self._sleep),
            (select, "select"): self._waiting("select.select", self._select),
            (threading.Event, "wait"): self._waiting("Event.wait", self._wait_event),
            (threading.Condition, "wait"): self._waiting("Condition.wait", self._wait_condition),
            (threading.Condition, "wait_for"): self._waiting("Condition.wait_for", self._wait_for),
            (queue.Queue, "get"): self._waiting("Queue.get", self._get),
            (queue.Queue, "put"): self._waiting("Queue.put", self._put),
        }

    def _look(self, name: str) -> Callable[..., Any]:
        def act(original: Callable[..., Any], frame: FrameType) -> Any:
            thread = threading.get_ident()
            if thread in self._others:
                return original()
            _check_clock()
            return getattr(self._clock if thread == self._owner else self._standing, name)()

        return act

    def _waiting(self, name: str, wait: Callable[..., Any]) -> Callable[..., Any]:
        def act(original: Callable[..., Any], frame: FrameType, *args: Any, **kwargs: Any) -> Any:
            thread = threading.get_ident()
            if thread in self._others:
                return original(*args, **kwargs)
            try:
                if thread != self._owner:
                    raise host_code.HostTimeError(_other_thread())
                _check_clock()
                return wait(original, *args, **kwargs)
            except _ForEver as error:
                raise host_code.HostTimeError(f"{_line_of(frame)}: {name} {error}") from None
            except host_code.HostTimeError as error:
                self.refusals.append(f"{_line_of(frame)}: {name}: {error}")
                raise host_code.HostTimeError(self.refusals[-1]) from None

        return act

    def _sleep(self, original: object, seconds: float) -> None:
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        self._clock.sleep(max(seconds, LOOK_US / 1e6))

    def _select(
        self, original: Callable[..., Any], r: Any, w: Any, x: Any, timeout: float | None = None
    ) -> Any:
        # With descriptors it waits for this machine; only `select([], [], [], t)` is a
        # sleep.
        if timeout is None or [*r, *w, *x]:
            return original(r, w, x, timeout)
        self._sleep(original, timeout)
        return [], [], []

    def _until(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        if done() or self._passing.wait(done, timeout_s):
            return True
        if timeout_s is None:
            raise _ForEver(_FOR_EVER)
        return False

    def _wait_event(
        self, original: object, event: threading.Event, timeout: float | None = None
    ) -> bool:
        return self._until(event.is_set, timeout)

    def _wait_condition(
        self, original: object, condition: Any, timeout: float | None = None
    ) -> bool:
        waiter = threading.Lock()
        waiter.acquire()
        condition._waiters.append(waiter)
        saved = condition._release_save()
        try:
            return self._until(lambda: not waiter.locked(), timeout)
        finally:
            condition._acquire_restore(saved)
            if waiter in condition._waiters:
                condition._waiters.remove(waiter)

    def _wait_for(
        self,
        original: object,
        condition: Any,
        predicate: Callable[[], Any],
        timeout: float | None = None,
    ) -> Any:
        saved = condition._release_save()
        try:
            self._until(lambda: bool(predicate()), timeout)
        finally:
            condition._acquire_restore(saved)
        return predicate()

    def _get(
        self,
        original: Callable[..., Any],
        items: queue.Queue[Any],
        block: bool = True,
        timeout: float | None = None,
    ) -> Any:
        if block:
            self._until(lambda: not items.empty(), timeout)
        return original(items, False)

    def _put(
        self,
        original: Callable[..., Any],
        items: queue.Queue[Any],
        item: Any,
        block: bool = True,
        timeout: float | None = None,
    ) -> None:
        if block:
            self._until(lambda: not items.full(), timeout)
        original(items, item, False)


class _Standing:
    """A frozen time for threads that only read the clock."""

    def __init__(self, passing: Passing) -> None:
        self._passing = passing

    @property
    def time_s(self) -> float:
        return self._passing.time_s

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        return done()


class _ForEver(Exception):  # noqa: N818 - it is told in another one
    """A wait without a timeout waits for an event that never happens."""


def _other_thread() -> str:
    name = threading.current_thread().name
    return (
        f"only the thread of the test makes virtual time pass, not {name!r}:"
        " run a host with threads in real time"
    )


@contextmanager
def patched_time(passing: Passing) -> Iterator[SimTime]:
    """Run hosts in the time of a rig.

    In host code these functions use the clock of `passing`:

    - `sleep`, `time`, `monotonic`, `perf_counter` of `time`, and their variants in nanoseconds
    - `wait` and `wait_for` of threading's events and conditions
    - `get` and `put` of queues
    - a `select` of nothing with a timeout

    Each read of the clock takes 100 us, so a loop that only reads the clock ends. If asyncio was
    imported before, event loops that are created in the block use the time of `passing` too.

    Host code is all code except that of Python, pytest, Hypothesis, coverage, pyserial, python-can,
    canopen and tickrig. The functions are replaced in modules of hosts wherever they are stored:
    names (`from time import sleep`), attributes of classes, defaults of arguments. Threads that
    already run keep their time. Of all other threads, only the caller's thread can wait.

    Not patched: functions that objects have stored before, `datetime`, `socket`, `Thread.join`,
    semaphores, `threading.Timer`, `queue.SimpleQueue`.

    Args:
        passing: object whose time advances: a `RigPassing`, or a `SimNetwork`.

    Yields:
        The clock.

    Raises:
        HostTimeError: another thread or a callback of the rig has waited. The error is raised in
            that thread or callback, and again at the end, because hosts often catch it. The error
            is also raised if freezegun or time-machine has replaced the clock.
    """
    _check_clock()
    clock = SimTime(passing)
    waits = _ClockWaits(passing, clock)
    with patches.Patches(waits.acts()), _loops(passing):
        yield clock
    if waits.refusals:
        raise host_code.HostTimeError(waits.refusals[0])


def _loops(passing: Passing) -> AbstractContextManager[None]:
    """Return a context that gives event loops the time of a rig, or an empty context."""
    if "asyncio" not in sys.modules:
        return nullcontext()
    return bench_loop.bench_loops(passing)


# Hosts that look at the clock of this machine while their bench is in virtual time.

_WAITS: Final = ("sleep", "monotonic", "monotonic_ns")
"""Functions that are called only to wait."""

_STAMPS: Final = ("time", "time_ns")
"""Functions that installed packages may call for time stamps."""

_IN_A_THREAD: Final = (
    "is called in a thread, which cannot make virtual time pass: let the test poll, or mark it"
    """ needs("real or hardware")"""
)

_WHAT_TO_DO: Final = (
    "in virtual time the clock of this machine means nothing: take the fixture bench_time, or wait"
    """ by bench.run_for or bench.sleep, or mark the test needs("real or hardware")"""
)


def _package_of(frame: FrameType) -> str:
    """Return the name of the running package."""
    name: str = frame.f_globals.get("__name__") or ""
    return name.partition(".")[0]


@contextmanager
def unpatched_time_fails(
    allowed: Collection[str] = (), others: Collection[threading.Thread] | None = None
) -> Iterator[None]:
    """Raise UnpatchedTimeError if a host sleeps in real time, or reads the clock of the machine.

    In virtual time such calls are mistakes. The error is raised at the first such call, with its
    file and line. If the host has caught the error, it is raised again at the end. If the error
    caused another exception, that exception gets a note with the error.

    Host code is defined as for `patched_time`; within a block of `patched_time` all calls are
    allowed. Always allowed are `perf_counter`, `time.time` in installed packages, and functions
    with which a test has replaced these functions.

    Args:
        allowed: names of packages whose calls are allowed.
        others: threads whose calls are allowed. The default is all threads that already run.
    """
    others = threading.enumerate() if others is None else others
    refusals: list[str] = []
    owner = threading.get_ident()
    spared = {thread.ident for thread in others} - {owner}

    def refuse(
        name: str, original: Callable[..., Any], frame: FrameType, *args: Any, **kwargs: Any
    ) -> Any:
        __tracebackhide__ = True
        if isinstance(original, patches.Patch) and original.on:  # of `patched_time`, around this
            return original.act(original.original, frame, *args, **kwargs)
        stamped = name in _STAMPS and host_code.is_installed(frame.f_code.co_filename)
        if stamped or _package_of(frame) in allowed or threading.get_ident() in spared:
            return original(*args, **kwargs)
        alone = threading.get_ident() == owner
        told = f"is called, but {_WHAT_TO_DO}" if alone else _IN_A_THREAD
        refusals.append(f"{_line_of(frame)}: time.{name} {told}")
        raise host_code.UnpatchedTimeError(refusals[-1])

    own = [
        name
        for name in (*_WAITS, *_STAMPS)
        if id(patches.root_of(vars(time)[name])) in patches.KEEPABLE
    ]
    with patches.Patches({(time, name): partial(refuse, name) for name in own}):
        try:
            yield
        except BaseException as error:  # it may come of what the host has swallowed
            if refusals and not isinstance(error, host_code.UnpatchedTimeError):
                error.add_note(refusals[0])
            raise
    if refusals:
        raise host_code.UnpatchedTimeError(refusals[0])
