"""Hosts that look at the clock of this machine while their bench is in virtual time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any, Final

from tickrig.emulators.testing.host_clock.errors import UnpatchedTimeError
from tickrig.emulators.testing.host_clock.host_code import is_installed, line_of, package_of
from tickrig.emulators.testing.host_clock.kept_names import KEEPABLE
from tickrig.emulators.testing.host_clock.switch import Switch, root_of
from tickrig.emulators.testing.host_clock.switches import Switches

WAITS: Final = ("sleep", "monotonic", "monotonic_ns")
"""What nobody calls but who waits."""

STAMPS: Final = ("time", "time_ns")
"""What installed packages may call: they stamp what they write."""

IN_A_THREAD: Final = (
    "is called in a thread, which cannot make virtual time pass: let the test poll, or mark it"
    """ needs("real or hardware")"""
)

WHAT_TO_DO: Final = (
    "in virtual time the clock of this machine means nothing: take the fixture bench_time, or wait"
    """ by bench.run_for or bench.sleep, or mark the test needs("real or hardware")"""
)


@contextmanager
def unpatched_time_fails(
    allowed: Collection[str] = (), others: Collection[threading.Thread] | None = None
) -> Iterator[None]:
    """Raise UnpatchedTimeError where a host sleeps, or looks at a clock that does not pass.

    It is raised at the first such call with its file and line, and once more at the end if the
    host has swallowed it; if another exception came of that, it is a note of that one. Whose code
    it is that counts, `patched_time` says; where that holds nothing is refused. `perf_counter` is
    let through, and `time.time` in installed packages, and what a test has put in place of these
    functions.

    Args:
        allowed: names of packages that may do so.
        others: threads that may do so; unless given, those that run already.
    """
    others = threading.enumerate() if others is None else others
    refusals: list[str] = []
    owner = threading.get_ident()
    spared = {thread.ident for thread in others} - {owner}

    def refuse(
        name: str, original: Callable[..., Any], frame: FrameType, *args: Any, **kwargs: Any
    ) -> Any:
        __tracebackhide__ = True
        if isinstance(original, Switch) and original.on:  # of `patched_time`, around this
            return original.act(original.original, frame, *args, **kwargs)
        stamped = name in STAMPS and is_installed(frame.f_code.co_filename)
        if stamped or package_of(frame) in allowed or threading.get_ident() in spared:
            return original(*args, **kwargs)
        alone = threading.get_ident() == owner
        told = f"is called, but {WHAT_TO_DO}" if alone else IN_A_THREAD
        refusals.append(f"{line_of(frame)}: time.{name} {told}")
        raise UnpatchedTimeError(refusals[-1])

    own = [name for name in (*WAITS, *STAMPS) if id(root_of(vars(time)[name])) in KEEPABLE]
    with Switches({(time, name): partial(refuse, name) for name in own}):
        try:
            yield
        except BaseException as error:  # it may come of what the host has swallowed
            if refusals and not isinstance(error, UnpatchedTimeError):
                error.add_note(refusals[0])
            raise
    if refusals:
        raise UnpatchedTimeError(refusals[0])
