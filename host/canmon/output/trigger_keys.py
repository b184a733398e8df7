"""Triggers by hand: Enter in the terminal, or a signal."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

from tickrig.host.links.ready import ready

KEY: Final = "key"
STDIN: Final = 0


class TriggerKeys:
    """Waits for Enter on standard input, where that is a terminal, and for SIGUSR1.

    Args:
        typed: somebody may type; not where standard input is what is recorded.
    """

    def __init__(self, typed: bool) -> None:
        self._typed = typed and sys.platform != "win32" and os.isatty(STDIN)
        self._signals = 0

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Take signals while the block runs."""
        if sys.platform == "win32":
            yield
        else:  # mypy leaves out the branch of the other system
            before = signal.signal(signal.SIGUSR1, self._signalled)
            # a job in the background that reads its terminal would be stopped
            ignored = signal.signal(signal.SIGTTIN, signal.SIG_IGN)
            try:
                yield
            finally:
                signal.signal(signal.SIGUSR1, before)
                signal.signal(signal.SIGTTIN, ignored)

    def pressed(self) -> str:
        """Return what was pressed since the last time; empty if nothing was."""
        if self._signals:
            self._signals = 0
            return "SIGUSR1"
        if not self._typed or not ready([STDIN], wait_s=0)[0]:
            return ""
        try:
            typed = os.read(STDIN, 1_024)
        except OSError:
            typed = b""
        self._typed = bool(typed)  # at its end nobody types any more
        return KEY if b"\n" in typed else ""

    def _signalled(self, number: int, frame: FrameType | None) -> None:
        self._signals += 1
