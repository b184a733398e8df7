"""Start and end a command, also by Ctrl-C, `kill`, a closed terminal or a full disk.

All commands start here. While a command is being loaded, a signal ends the process at once.
Afterwards, Ctrl-C, SIGTERM and SIGHUP raise KeyboardInterrupt (`Interrupter`), so that the command
can clean up.

Data from files, buses and serial lines may contain control characters that a terminal would
interpret. Therefore all text that a command prints passes `_HarmlessStream`. Two kinds of output
use `paint` instead: the screens that a command draws itself, and output for programs.
"""

from __future__ import annotations

import _thread
import errno
import io
import os
import select
import signal
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from types import FrameType
from typing import Any, Final, TextIO

INTERRUPTED: Final = 128 + signal.SIGINT
"""Exit status that shells give a program that Ctrl-C ended."""

FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""Error codes for a full disk, a lost terminal, and a file that is open only for reading."""

UNWRITTEN: Final = 3
"""Exit status if standard output accepts no more data."""

_IMPORTER: Final = "<frozen importlib._bootstrap"
"""Beginning of the file names of Python's own importer."""

_AGAIN_S: Final = 0.01
_MOST_REPEATS: Final = 200
"""Number of repetitions of a signal after which a long import is interrupted."""

_TERMINAL_MS: Final = 500
"""Time without accepted data after which a terminal is given up when a signal ends the command."""

_Handler = Callable[[int, FrameType | None], None]


def start(name: str, path: str) -> None:
    """Run a command as a console script: import it, handle its signals and errors, and exit.

    Args:
        name: name of the command that users type.
        path: location of the command, in the form `MODULE:NAME`.
    """
    command: Any = load(path)
    status: Any = 0
    from click import Abort, ClickException, echo  # noqa: PLC0415 - the command has loaded it

    interrupter = Interrupter()
    try:
        with taking_signals(interrupter.received), interrupter.repeating():
            status = command.main(prog_name=name, standalone_mode=False)
    except KeyboardInterrupt as interrupt:  # before or behind where click looks for it
        status = _status_of(interrupt)
    except Abort as abort:
        status = 1
        if isinstance(abort.__context__, KeyboardInterrupt):
            status = _status_of(abort.__context__)
        else:
            echo("Aborted!", err=True)
    except ClickException as error:
        with standard_streams():
            error.show()
        status = error.exit_code
    except OSError as error:  # of printing: whoever opens a file tells its name
        if error.filename is not None or error.errno not in FULL:
            raise
        _to_nowhere(sys.stdout.fileno())
        with suppress(OSError):  # standard error may be full as well
            print(f"Error: standard output: {error.strerror or error}", file=sys.stderr)
        status = UNWRITTEN
    if interrupter.pending:
        status = 128 + interrupter.pending
    sys.exit(status if isinstance(status, int) else 0)


def _status_of(interrupt: KeyboardInterrupt) -> int:
    return 128 + int(interrupt.args[0]) if interrupt.args else INTERRUPTED


def _open_closed_streams() -> None:
    """Open the standard streams that the caller has closed, as `>&-` does.

    Otherwise, the next file or socket would get the descriptor of a closed stream, and messages
    would be written into it. A standard input opened here is empty. Text written to a standard
    output or standard error opened here is dropped, and the exit status does not change.
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


_PLAIN: Final = bytes((ord("\n"), *range(0x20, 0x7F)))
"""ASCII characters that are harmless to a terminal."""


class _HarmlessStream(io.TextIOWrapper):
    """Standard output or standard error with visible symbols in place of control characters.

    Args:
        stream: stream to write to. Other code may also use the stream directly.
        drops: whether to drop text that does not fit on a full disk. Otherwise writing raises
            OSError.

    Attributes:
        as_is: stream that was passed in.
    """

    def __init__(self, stream: TextIO, *, drops: bool = False) -> None:
        self.as_is, self._drops = stream, drops
        encoding = stream.encoding or "utf-8"
        super().__init__(
            stream.buffer,
            "utf-8" if encoding.lower() in ("ascii", "us-ascii", "ansi_x3.4-1968") else encoding,
            "backslashreplace",
            line_buffering=getattr(stream, "line_buffering", False),
            write_through=getattr(stream, "write_through", False),
        )

    def write(self, text: str, /) -> int:
        """Write text for the user."""
        # of ASCII, bytes are looked at: a twentieth of the time of looking at characters
        ascii_bytes = text.encode("ascii") if text.isascii() else b"\0"
        if ascii_bytes.translate(None, _PLAIN) and not text.replace("\n", "").isprintable():
            from tickrig.host.text.page_text import harmless  # noqa: PLC0415 - seldom wanted

            text = harmless(text)
        try:
            return super().write(text)
        except OSError as error:
            if not self._drops or error.errno not in FULL:
                raise
            _to_nowhere(self.fileno())
            return len(text)


def paint(stream: TextIO, text: str) -> None:
    """Write text to a stream at once, without replacing control characters.

    The text is a screen that a command draws, or output for programs.
    """
    stream = as_is(stream)
    stream.write(text)
    stream.flush()


def write_harmless(stream: TextIO, text: str) -> None:
    """Write text that has no control characters. This is faster than `write`, which checks it."""
    if isinstance(stream, _HarmlessStream):
        io.TextIOWrapper.write(stream, text)
    else:
        stream.write(text)


def as_is(stream: TextIO) -> TextIO:
    """Return a stream that writes text unchanged, without replacing control characters."""
    stream.flush()
    return stream.as_is if isinstance(stream, _HarmlessStream) else stream


@contextmanager
def standard_streams() -> Iterator[None]:
    """Context manager that makes the standard streams safe for its block.

    Streams that were closed are opened, and control characters in output are replaced. If standard
    error is a file on a full disk, the command continues. The messages are dropped, and the exit
    status does not change.
    """
    _open_closed_streams()
    before = sys.stdout, sys.stderr
    if isinstance(sys.stdout, _HarmlessStream):
        yield
        return
    ours = [
        _HarmlessStream(one, drops=one is before[1]) if hasattr(one, "buffer") else one
        for one in before
    ]
    sys.stdout, sys.stderr = ours
    try:
        yield
    finally:
        with suppress(BrokenPipeError):  # click has seen to it that this passes in silence
            for stream in ours:
                if isinstance(stream, _HarmlessStream):
                    stream.detach()
            sys.stdout, sys.stderr = before


def raise_of_output(error: Exception) -> None:
    """Raise an error again if it came from writing standard output. Otherwise, return.

    If this function returns, the caller must report the error. If the reader has closed the pipe,
    as `| head` does, the error is raised again, and the command ends without a message.
    """
    printing = isinstance(error, OSError) and error.filename is None
    if printing and error.errno in (*FULL, errno.EPIPE):  # type: ignore[attr-defined]
        raise error


def load(path: str) -> Any:
    """Return the object at `MODULE:NAME`."""
    module, _, name = path.partition(":")
    with loading():
        return getattr(import_module(module), name)


@contextmanager
def loading() -> Iterator[None]:
    """Context manager in which Ctrl-C ends the process at once, because nothing needs a clean-up.

    The context manager is used while modules are imported. If the caller has its own handler for
    Ctrl-C, the handler is not replaced. Outside of the main thread, the context manager does
    nothing.
    """
    handler = signal.getsignal(signal.SIGINT)
    owner = getattr(handler, "__self__", None)
    plain = handler is signal.default_int_handler or type(owner) is Interrupter
    if not plain or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


class Interrupter:
    """Signal handler that raises KeyboardInterrupt, but not in the middle of an import.

    An exception during an import may be lost, or leave a module half loaded. If a signal arrives
    during an import, the handler therefore sends the signal to its own process again a little
    later. It repeats this until the import has ended, for two seconds at most.

    Attributes:
        pending: number of the signal that is sent again, or 0 if there is none.
    """

    def __init__(self) -> None:
        self.pending = self._repeats = 0

    def received(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal. The argument of the KeyboardInterrupt is the number of the signal."""
        give_up_terminals()
        if _is_importing(frame) and self._repeats < _MOST_REPEATS:
            self._repeat(number)
            return
        self.pending = self._repeats = 0
        raise KeyboardInterrupt(number)

    @contextmanager
    def repeating(self) -> Iterator[None]:
        """Repeat a signal whose exception Python ignores, for example in a `__del__`."""
        before = sys.unraisablehook

        def unraisable(lost: sys.UnraisableHookArgs, /) -> None:
            if isinstance(lost.exc_value, KeyboardInterrupt):
                self._repeat(_status_of(lost.exc_value) - 128)
            else:
                before(lost)

        sys.unraisablehook = unraisable
        try:
            yield
        finally:
            sys.unraisablehook = before

    def _repeat(self, number: int) -> None:
        self.pending, self._repeats = number, self._repeats + 1
        _thread.start_new_thread(_send_later, (number,))  # takes no lock that may be held here


def _send_later(number: int) -> None:
    time.sleep(_AGAIN_S)
    if sys.platform == "win32":
        signal.raise_signal(number)
    else:  # to the main thread, so that it ends a wait of it
        signal.pthread_kill(threading.main_thread().ident or 0, number)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTER):
            return True
        frame = frame.f_back
    return False


@contextmanager
def taking_signals(received: _Handler) -> Iterator[None]:
    """Context manager in which Ctrl-C (SIGINT), SIGTERM and SIGHUP call the function `received`.

    SIGINT is handled even if it was ignored at the start, because a shell script that starts a
    command in the background (`&`) makes the command ignore SIGINT. SIGHUP stays ignored if it was
    ignored at the start, because nohup needs this.
    """
    numbers = [signal.SIGINT, signal.SIGTERM]
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, received) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def give_up_terminals() -> None:
    """Drop all further output to a terminal that is gone or accepts no data for half a second.

    Without this call, a stopped terminal could prevent the command from ending. A call of `write`
    that already waits for the terminal continues to wait.
    """
    for descriptor in (1, 2):
        if sys.platform != "win32" and _is_stuck(descriptor):
            _to_nowhere(descriptor)


if sys.platform != "win32":

    def _is_stuck(descriptor: int) -> bool:
        """Return whether a stream is a terminal that is gone, or accepts no data.

        A terminal with room for a single byte reports that it can be written, but writing CR LF
        would block. A NUL, which terminals ignore, fills that byte.
        """
        try:
            if not stat.S_ISCHR(os.fstat(descriptor).st_mode):
                return False
            if os.isatty(descriptor):
                flags = os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK
                probe = os.open(os.ttyname(descriptor), flags)
                with suppress(BlockingIOError):
                    os.write(probe, b"\0")
                os.close(probe)
        except OSError:  # closed, or a terminal of another container
            pass
        poll = select.poll()
        poll.register(descriptor, select.POLLOUT)
        ready = poll.poll(_TERMINAL_MS)
        return not ready or bool(ready[0][1] & (select.POLLERR | select.POLLHUP))


def _to_nowhere(descriptor: int) -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, descriptor)
    os.close(null)
