"""A terminal with single keys, and output without blocking."""

from __future__ import annotations

import errno
import os
import select
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final

_LOCAL_FLAGS: Final = 3
_CONTROL_CHARACTERS: Final = 6
"""Positions in the result of `termios.tcgetattr`."""


def take_keys(descriptor: int) -> Callable[[], None]:
    """Switch a terminal to a mode in which each key can be read at once, without echo.

    Reading the terminal then does not block. Ctrl-Z is disabled, because a program stopped by it
    would leave the terminal in this mode.

    Args:
        descriptor: file descriptor of the terminal.

    Returns:
        A function that restores the former mode. It does nothing if the terminal is gone.

    Raises:
        OSError: the descriptor is not a terminal, or the system has no POSIX terminals (Windows).
    """
    if sys.platform == "win32":
        raise OSError(errno.ENOTTY, "keys are read of POSIX terminals alone")
    else:  # noqa: RET506 - mypy leaves out the branch of the other system
        import termios  # noqa: PLC0415 - not on Windows

        def give_back() -> None:
            with suppress(termios.error):  # it is gone
                termios.tcsetattr(descriptor, termios.TCSANOW, before)  # TCSAFLUSH waits for output
                termios.tcflush(descriptor, termios.TCIFLUSH)

        try:
            before, modes = termios.tcgetattr(descriptor), termios.tcgetattr(descriptor)
            modes[_LOCAL_FLAGS] &= ~(termios.ICANON | termios.ECHO)
            characters = modes[_CONTROL_CHARACTERS]
            characters[termios.VMIN] = characters[termios.VTIME] = 0
            characters[termios.VSUSP] = b"\0"
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, modes)
        except termios.error as error:
            raise OSError(*error.args) from error
        return give_back


MOST_WAITING: Final = 131_072
"""Maximum number of bytes that wait for a terminal."""

_CLOSING_S: Final = 0.5
_LOOK_S: Final = 0.5


class TerminalOutput:
    """Writer that outputs text from its own thread, so that a stuck terminal blocks nothing else.

    A terminal is stuck while its program is stopped, or while its connection hangs. Text that does
    not fit into the queue is then dropped.

    Args:
        descriptor: file descriptor of the terminal. The writer uses a duplicate of it.
        caught_up: function that the thread calls after text was dropped, as soon as all queued text
            is written.
        lost: function that the thread calls when the terminal is gone.

    Attributes:
        gone: whether the terminal is gone.
    """

    def __init__(
        self,
        descriptor: int,
        caught_up: Callable[[], object] = lambda: None,
        lost: Callable[[], object] = lambda: None,
    ) -> None:
        self.gone = False
        self._caught_up, self._lost = caught_up, lost
        self._waiting, self._writing = bytearray(), False
        self._dropped = self._closing = False
        self._changed = threading.Condition()
        self._descriptor = os.dup(descriptor)
        self._thread = threading.Thread(target=self._run, name="terminal-output", daemon=True)
        self._thread.start()

    @property
    def is_behind(self) -> bool:
        """Whether the terminal has not accepted all text yet."""
        return bool(self._waiting) or self._writing

    def catches_up(self, within_s: float) -> bool:
        """Wait until the terminal has accepted all text. Return False after the time-out."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.is_behind, within_s)

    def write(self, text: str, *, last: bool = False) -> None:
        """Queue a text. A text that is marked `last` is never dropped."""
        data = text.encode("utf-8", "replace")
        with self._changed:
            if self.gone:
                return
            if len(self._waiting) + len(data) > MOST_WAITING and self.is_behind and not last:
                self._dropped = True
                return
            self._waiting += data
            self._changed.notify_all()

    def close(self) -> bool:
        """End the thread. Return False if the terminal does not accept the remaining text."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(_CLOSING_S)
        return not (self._thread.is_alive() or self.gone)

    def _run(self) -> None:
        """Write until all text is written after `close`, or the terminal is gone."""
        try:
            while not self._ends():
                with self._changed:
                    data, self._waiting = bytes(self._waiting), bytearray()
                    self._writing = True
                while data:
                    data = data[os.write(self._descriptor, data) :]
                self._note_written()
        except OSError:
            with self._changed:
                self.gone, self._writing = True, False
                self._waiting.clear()
            self._lost()
        os.close(self._descriptor)

    def _ends(self) -> bool:
        """Wait for text. Return True at the end, and raise OSError if the terminal is gone."""
        with self._changed:
            while not self._waiting and not self._closing:
                if not self._changed.wait(_LOOK_S) and _is_hung_up(self._descriptor):
                    raise OSError(errno.EIO, os.strerror(errno.EIO))
            return not self._waiting

    def _note_written(self) -> None:
        with self._changed:
            self._writing = False
            caught_up = self._dropped and not self._waiting
            self._dropped = self._dropped and not caught_up
            self._changed.notify_all()
        if caught_up:
            self._caught_up()


def _is_hung_up(descriptor: int) -> bool:
    hung_up = False
    if sys.platform != "win32":
        poll = select.poll()
        poll.register(descriptor, 0)
        hung_up = bool(poll.poll(0))
    return hung_up
