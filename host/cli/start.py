"""Begin and end a command: no Ctrl-C and no full disk shows a traceback, no text obeys a stranger.

What files, buses and lines hold may carry characters that a terminal obeys. So whatever a command
prints passes `HarmlessStream`, in one place for all of them; what a command itself paints, and what
programs read, goes through `paint`.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any, Final, TextIO

INTERRUPTED: Final = 128 + signal.SIGINT
"""Exit status that shells give a program which Ctrl-C ended."""

FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""What a full disk says, a terminal that is gone, and a file that was opened to be read alone."""

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
        with suppress(OSError):  # standard error may be full as well
            print(f"Error: standard output: {error.strerror or error}", file=sys.stderr)
        sys.exit(UNWRITTEN)
    finally:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # nothing is left to be tidied up


def open_closed_streams() -> None:
    """Open the standard streams that the caller has closed, as `>&-` does.

    The next file or socket would get their numbers, and messages would go into it. Standard input
    is empty then; what is written to the others is dropped, and the exit status stays as it is.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, os.O_WRONLY if number else os.O_RDONLY)
            if opened == number:
                os.set_inheritable(number, True)  # as standard streams are
            else:
                os.dup2(opened, number)
                os.close(opened)
        if getattr(sys, name) is None:
            mode = "w" if number else "r"
            stream = open(number, mode, encoding="utf-8", buffering=1, closefd=False)  # noqa: SIM115 - to the end
            setattr(sys, name, stream)


class HarmlessStream(io.TextIOWrapper):
    """Standard output or error; characters that a terminal obeys are written as pictures.

    Args:
        stream: what is written to; both may be used.

    Attributes:
        as_is: that stream.
    """

    def __init__(self, stream: TextIO) -> None:
        self.as_is = stream
        encoding = stream.encoding or "utf-8"
        super().__init__(
            stream.buffer,
            "utf-8" if encoding.lower() in ("ascii", "us-ascii", "ansi_x3.4-1968") else encoding,
            "backslashreplace",
            line_buffering=getattr(stream, "line_buffering", False),
            write_through=getattr(stream, "write_through", False),
        )

    def write(self, text: str, /) -> int:
        """Write text for people."""
        if not text.replace("\n", "").isprintable():
            from tickrig.host.text.page_text import harmless  # noqa: PLC0415 - seldom wanted

            text = harmless(text)
        return super().write(text)


def paint(stream: TextIO, text: str) -> None:
    """Write at once what a command paints itself, or what a program reads: nothing is replaced."""
    stream = as_is(stream)
    stream.write(text)
    stream.flush()


def as_is(stream: TextIO) -> TextIO:
    """Return the stream that writes what a command paints itself."""
    stream.flush()
    return stream.as_is if isinstance(stream, HarmlessStream) else stream


@contextmanager
def standard_streams() -> Iterator[None]:
    """Have all three while the block runs; what it prints is harmless to the terminal."""
    open_closed_streams()
    before = sys.stdout, sys.stderr
    if isinstance(sys.stdout, HarmlessStream):
        yield
        return
    ours = [HarmlessStream(one) if hasattr(one, "buffer") else one for one in before]
    sys.stdout, sys.stderr = ours
    try:
        yield
    finally:
        with suppress(BrokenPipeError):  # click has seen to it that this passes in silence
            for stream in ours:
                if isinstance(stream, HarmlessStream):
                    stream.detach()
            sys.stdout, sys.stderr = before


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
