"""Threads of hosts that die: pytest only warns of them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from traceback import format_exception_only, walk_tb
from typing import Final

from tickrig.emulators.testing.host_clock.host_code import is_host, place_of

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
