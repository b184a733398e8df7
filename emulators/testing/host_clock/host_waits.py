"""What hosts find in place of functions that tell the time, and that wait."""

from __future__ import annotations

import queue
import select
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, Final

from tickrig.emulators.rig.sim_waits import LOOK_US, Passing, SimTime
from tickrig.emulators.testing.host_clock.errors import HostTimeError
from tickrig.emulators.testing.host_clock.host_code import line_of
from tickrig.emulators.testing.host_clock.kept_names import LOOKS
from tickrig.emulators.testing.host_clock.switches import Acts

FOR_EVER: Final = (
    "waits for ever: nothing that happens on the bench ends it, and another thread cannot"
)


OTHER_CLOCKS: Final = {
    "freezegun": ("freezegun.api", ("freeze_factories",)),
    "time-machine": ("time_machine", ("traveller_stack", "coordinates_stack")),
}
"""Packages that replace the clock, and where each keeps what replaces it at present."""


def check_clock() -> None:
    """Raise HostTimeError if freezegun or time-machine has replaced the clock.

    Both tell `datetime` and `time` another time, and freezegun's `monotonic` stands still, so
    that a host that polls until a deadline never reaches it.
    """
    for package, (module, stacks) in OTHER_CLOCKS.items():
        if (found := sys.modules.get(module)) and any(getattr(found, s, None) for s in stacks):
            raise HostTimeError(
                f"{package} has replaced the clock, and so does bench_time (bench.patched_time):"
                " use one of them; bench_time begins at 2000-01-01 and moves datetime not at all"
            )


class HostWaits:
    """What hosts find in place of what waits.

    Args:
        passing: whose time passes.
        clock: its functions of `time`.

    Attributes:
        refusals: who waited where nobody can: in another thread, or called back by the rig.
    """

    def __init__(self, passing: Passing, clock: SimTime) -> None:
        self._passing, self._clock = passing, clock
        self.refusals: list[str] = []
        self._standing = SimTime(_Standing(passing))
        self._owner = threading.get_ident()
        self._others = {thread.ident for thread in threading.enumerate()} - {self._owner}

    def acts(self) -> Acts:
        """Return them all."""
        return {
            **{(time, name): self._look(name) for name in LOOKS},
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
            check_clock()
            return getattr(self._clock if thread == self._owner else self._standing, name)()

        return act

    def _waiting(self, name: str, wait: Callable[..., Any]) -> Callable[..., Any]:
        def act(original: Callable[..., Any], frame: FrameType, *args: Any, **kwargs: Any) -> Any:
            thread = threading.get_ident()
            if thread in self._others:
                return original(*args, **kwargs)
            try:
                if thread != self._owner:
                    raise HostTimeError(_other_thread())
                check_clock()
                return wait(original, *args, **kwargs)
            except _ForEver as error:
                raise HostTimeError(f"{line_of(frame)}: {name} {error}") from None
            except HostTimeError as error:
                self.refusals.append(f"{line_of(frame)}: {name}: {error}")
                raise HostTimeError(self.refusals[-1]) from None

        return act

    def _sleep(self, original: object, seconds: float) -> None:
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        self._clock.sleep(max(seconds, LOOK_US / 1e6))

    def _select(
        self, original: Callable[..., Any], r: Any, w: Any, x: Any, timeout: float | None = None
    ) -> Any:
        if timeout is None or [*r, *w, *x]:
            return original(r, w, x, timeout)
        self._sleep(original, timeout)
        return [], [], []

    def _until(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        if done() or self._passing.wait(done, timeout_s):
            return True
        if timeout_s is None:
            raise _ForEver(FOR_EVER)
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
    """A time that does not pass by itself, for threads that only look."""

    def __init__(self, passing: Passing) -> None:
        self._passing = passing

    @property
    def time_s(self) -> float:
        return self._passing.time_s

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        return done()


class _ForEver(Exception):  # noqa: N818 - it is told in another one
    """What is waited for without a timeout does not come."""


def _other_thread() -> str:
    name = threading.current_thread().name
    return (
        f"only the thread of the test makes virtual time pass, not {name!r}:"
        " run a host with threads in real time"
    )
