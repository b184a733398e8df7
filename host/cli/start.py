"""Begin a command: Ctrl-C ends it while it loads, too, and no traceback is seen."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any


def load(path: str) -> Any:
    """Return what stands at `MODULE:NAME`."""
    module, _, name = path.partition(":")
    with loading():
        return getattr(import_module(module), name)


@contextmanager
def loading() -> Iterator[None]:
    """Let Ctrl-C end the process, as it ends a program that takes no notice of it.

    A KeyboardInterrupt in the middle of an import would show where that was. Where
    Ctrl-C is ignored, or somebody waits for it, that stays so.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
