"""A keyboard as a pad: a key pushes while it repeats."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Final

from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.terminal import take_keys
from tickrig.host.motion.options.pad import StickPosition

KEYS: Final[Mapping[str, StickPosition]] = {
    "w": StickPosition(forward=1.0),
    "s": StickPosition(forward=-1.0),
    "a": StickPosition(turn=1.0),
    "d": StickPosition(turn=-1.0),
    "q": StickPosition(left=1.0),
    "e": StickPosition(left=-1.0),
    " ": StickPosition(),
}

HOLD_US: Final = 300_000
"""A key pushes so long after it came; terminals repeat it sooner than that."""


class KeyboardPad:
    """Reads keys of a terminal: w s forward and back, a d turn, q e sideways, space stop.

    Args:
        fd: of the terminal, standard input unless given.

    Attributes:
        close: lets the terminal be as it was.

    Raises:
        LinkClosed: it is no terminal.
    """

    def __init__(self, fd: int | None = None) -> None:
        self._fd = sys.stdin.fileno() if fd is None else fd
        try:
            self.close = take_keys(self._fd)
        except OSError as error:
            raise LinkClosed(f"the keyboard is no terminal: {error.strerror}") from error
        self._hand, self._until_us = StickPosition(), 0

    def poll(self, now_us: int, /) -> StickPosition:
        """Return where the latest key pushes."""
        for key in os.read(self._fd, 256).decode("latin-1"):
            if key in KEYS:
                self._hand, self._until_us = KEYS[key], now_us + HOLD_US
        return self._hand if now_us < self._until_us else StickPosition()
