"""Begin and end a command: no Ctrl-C and no full disk shows a traceback."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Final

INTERRUPTED: Final = 128 + signal.SIGINT
"""Exit status that shells give a program which Ctrl-C ended."""

FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What a full disk says, and a terminal that is gone."""

if sys.platform == "win32":
    TERMINATING: Final = (signal.SIGTERM,)
else:
    TERMINATING: Final = (signal.SIGTERM, signal.SIGHUP)
"""Signals beside Ctrl-C that end a program, the latter when its terminal is closed."""

UNWRITTEN: Final = 3
"""Exit status where standard output takes nothing more."""


def start(name: str, path: str) -> None:
    """Run a command as a console script.

    Args:
        name: what people call it.
        path: where it is, as `MODULE:NAME`.
    """
    command = load(path)
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:  # `tickrig.commands` has seen to it
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        command(prog_name=name)
    except KeyboardInterrupt:  # before or behind where click looks for it
        sys.exit(INTERRUPTED)
    except OSError as error:  # of printing: whoever opens a file tells its name
        if error.filename is not None or error.errno not in FULL:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"Error: standard output: {error.strerror or error}", file=sys.stderr)
        sys.exit(UNWRITTEN)
    finally:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # nothing is left to be tidied up


def raise_of_output(error: Exception) -> None:
    """Raise an error of printing once more, which is no matter of what was printed.

    Where somebody reads no further, as before `| head`, the command ends without a word.
    """
    printing = isinstance(error, OSError) and error.filename is None
    if printing and error.errno in (*FULL, errno.EPIPE):  # type: ignore[attr-defined]
        raise error


def load(path: str) -> Any:
    """Return what stands at `MODULE:NAME`."""
    module, _, name = path.partition(":")
    with loading():
        return getattr(import_module(module), name)


@contextmanager
def loading() -> Iterator[None]:
    """Let Ctrl-C end the process, as it ends a program that takes no notice of it.

    A KeyboardInterrupt in the middle of an import would show where that was. Where
    Ctrl-C is ignored, or somebody waits for it, that stays so; threads see none of it.
    """
    waited_for = signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    if waited_for or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
