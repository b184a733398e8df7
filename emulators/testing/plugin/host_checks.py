"""What a test in virtual time may not do: mistake the clock of the machine for its own."""

from __future__ import annotations

import re
import sys
import threading
import warnings
from collections.abc import Callable, Collection, Container, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Thread
from traceback import format_exception_only, walk_tb
from typing import Any, Final

from tickrig.emulators.testing.bench.bench import VIRTUAL
from tickrig.emulators.testing.host_clock.host_code import is_host, place_of
from tickrig.emulators.testing.host_clock.patched_time import unpatched_time_fails

# Threads of hosts that die: pytest only warns of them.

THREADS: Final = "threads"


@contextmanager
def dead_threads(note: Callable[[str], None]) -> Iterator[None]:
    """Note threads that are started meanwhile and die: name, where, of what.

    Who was there before is told as ever: by pytest's warning, which comes for all of them. One
    that ends by `sys.exit()` has not died, unless that names an error.

    Args:
        note: called in the thread that dies, with a line.
    """
    others, before = set(threading.enumerate()), threading.excepthook

    def hook(died: threading.ExceptHookArgs) -> None:
        if died.thread not in others and not _has_ended(died.exc_value):
            note(_text(died))
        before(died)

    threading.excepthook = hook
    try:
        yield
    finally:
        threading.excepthook = before


def _has_ended(error: BaseException | None) -> bool:
    return isinstance(error, SystemExit) and not error.code


def _text(died: threading.ExceptHookArgs) -> str:
    name = died.thread.name if died.thread else "?"
    what = format_exception_only(died.exc_type, died.exc_value)[-1].strip()
    return f"thread {name!r} has died at {_place(died)}: {what.removeprefix(_module(died))}"


def _module(died: threading.ExceptHookArgs) -> str:
    return f"{died.exc_type.__module__}."


def _place(died: threading.ExceptHookArgs) -> str:
    """Return where it was in the code of the host, or at all."""
    places = [(frame, line) for frame, line in walk_tb(died.exc_traceback)]
    own = [
        (frame, line)
        for frame, line in places
        if is_host(frame.f_globals.get("__name__") or "", frame.f_code.co_filename)
    ]
    frame, line = (own or places)[-1]
    return place_of(frame.f_code.co_filename, line)


# Coroutines that a test makes and forgets: what stands in them never happens.

_WARNING: Final = r"coroutine '.*' was never awaited"
"""How Python warns of it, when such a coroutine is thrown away."""

_TOLD: Final = re.compile(r"coroutine '(.*)' was never awaited(?s:.*)  File \"(.*)\", line (\d+)")


@contextmanager
def never_awaited(note: Callable[[str], None]) -> Iterator[None]:
    """Note coroutines that are thrown away without having run, whatever filters warnings.

    Args:
        note: called with a line.
    """
    depth = sys.get_coroutine_origin_tracking_depth()
    with warnings.catch_warnings():
        # By default only the first of a line is told; with "error" it is raised in a
        # finalizer, where Python only prints it.
        warnings.filterwarnings("always", _WARNING, RuntimeWarning)
        show = warnings.showwarning

        def showwarning(message: Warning | str, *where: Any, **more: Any) -> None:
            if told := _TOLD.match(str(message)):
                name, file, line = told.groups()
                note(f"{name} was called and not awaited at {place_of(file, int(line))}")
            show(message, *where, **more)

        warnings.showwarning = showwarning
        # Without it the warning does not say where the coroutine was made.
        sys.set_coroutine_origin_tracking_depth(max(1, depth))
        try:
            yield
        finally:
            sys.set_coroutine_origin_tracking_depth(depth)


CLOCK: Final = "clock"


def guard(
    mode: str, allowed: Container[str], others: Collection[Thread]
) -> AbstractContextManager[None]:
    """Return what fails a test in virtual time that looks at the clock of the machine.

    Args:
        mode: of its bench.
        allowed: what its markers allow.
        others: threads that ran before there was a bench.
    """
    if mode != VIRTUAL or CLOCK in allowed:
        return nullcontext()
    return unpatched_time_fails(others=others)
