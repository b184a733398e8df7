"""A terminal as a source of keys, each of them at once and not shown."""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Final

LOCAL_FLAGS: Final = 3
CONTROL_CHARACTERS: Final = 6
"""Their places in what `termios.tcgetattr` returns."""


def take_keys(descriptor: int) -> Callable[[], None]:
    """Let a terminal give each key at once and not show it; reading never waits.

    Ctrl-Z does nothing: it would leave the terminal half taken.

    Args:
        descriptor: of the terminal.

    Returns:
        What gives it back as it was, unless it is gone.

    Raises:
        OSError: it is no terminal, or the system has none of that kind (Windows).
    """
    if sys.platform == "win32":
        raise OSError(errno.ENOTTY, "keys are read of POSIX terminals alone")
    else:  # noqa: RET506 - mypy leaves out the branch of the other system
        import termios  # noqa: PLC0415 - not on Windows

        def give_back() -> None:
            with suppress(termios.error):  # it is gone
                termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)

        try:
            before, modes = termios.tcgetattr(descriptor), termios.tcgetattr(descriptor)
            modes[LOCAL_FLAGS] &= ~(termios.ICANON | termios.ECHO)
            characters = modes[CONTROL_CHARACTERS]
            characters[termios.VMIN] = characters[termios.VTIME] = 0
            characters[termios.VSUSP] = b"\0"
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, modes)
        except termios.error as error:
            raise OSError(*error.args) from error
        return give_back
