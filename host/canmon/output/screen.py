"""A terminal that is painted line by line: only lines that changed are written."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType
from typing import Final, Self

from tickrig.host.cli.start import give_up_terminals
from tickrig.host.links.ready import ready
from tickrig.host.links.terminal import TerminalOutput, take_keys
from tickrig.host.text.page_text import in_cells

ENTER: Final = "\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[2J"
"""Alternate screen, no cursor, no wrapping, all clear."""

LEAVE: Final = "\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"
_CLEAR: Final = "\x1b[2J"

_ARROWS: Final = {"\x1b[A": "k", "\x1b[B": "j", "\x1b[5~": "p", "\x1b[6~": "f"}
"""Keys that are more than a character, and what is pressed instead."""

_KEY: Final = re.compile(r"\x1b\[[0-9;]*[A-Za-z~]|.", re.DOTALL)
_COLOUR: Final = re.compile(r"(\x1b\[(?:[07]|3[1-6])m)")
_TERMINAL: Final = "/dev/tty"
_PATIENCE_S: Final = 0.02


class Screen:
    """The controlling terminal, also where standard input is a pipe.

    On leaving, however that comes about, the terminal is as it was before. One that is stuck
    holds nobody up: nothing is painted until it has taken the last picture.

    Raises:
        OSError: there is no terminal.
    """

    def __init__(self) -> None:
        self._terminal = os.open(_TERMINAL, os.O_RDWR)
        self._output = TerminalOutput(self._terminal)
        self._painted: list[str] = []
        self._size = (0, 0)

    def __enter__(self) -> Self:
        """Take the terminal."""
        self._give_back = take_keys(self._terminal)
        self._output.write(ENTER)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give it back."""
        self._output.write(LEAVE, last=True)
        if not self._output.close():
            give_up_terminals()
        self._give_back()
        os.close(self._terminal)

    @property
    def is_gone(self) -> bool:
        """Whether the terminal was closed."""
        return self._output.gone

    def size(self) -> tuple[int, int]:
        """Return its columns and lines; 80 x 24 if it is gone."""
        with suppress(OSError):
            return os.get_terminal_size(self._terminal)
        return (80, 24)

    def keys(self) -> list[str]:
        """Return the keys that were pressed; none if it is gone."""
        text = ""
        with suppress(OSError):
            if ready([self._terminal], wait_s=0)[0]:
                text = os.read(self._terminal, 1_024).decode("utf-8", "replace")
        return [_ARROWS.get(key, key) for key in _KEY.findall(text)]

    def paint(self, lines: Sequence[str]) -> None:
        """Show lines, if the terminal has taken those of before.

        The only codes in them that the terminal obeys are those of colours.
        """
        if not self._output.catches_up(_PATIENCE_S):
            return
        lines, size = list(map(_painted, lines)), self.size()
        before = self._painted if size == self._size else []
        text = _difference(before, lines)
        self._output.write(text if size == self._size else _CLEAR + text)
        self._painted, self._size = lines, size


def _painted(line: str) -> str:
    r"""Return a line with nothing for the terminal but our colours.

    >>> _painted("\x1b[7m01\x1b[0m \x1b]52;c;\a")
    '\x1b[7m01\x1b[0m ␛]52;c;␇'
    """
    pieces = _COLOUR.split(line)
    return "".join(one if place % 2 else in_cells(one) for place, one in enumerate(pieces))


def _difference(before: Sequence[str], lines: Sequence[str]) -> str:
    r"""Return what to write so that lines are shown where others are.

    >>> _difference(["a", "b", "c"], ["a", "x"])
    '\x1b[2;1Hx\x1b[K\x1b[3;1H\x1b[K'
    """
    shown = [*lines, *[""] * (len(before) - len(lines))]
    return "".join(
        f"\x1b[{place};1H{line}\x1b[K"
        for place, line in enumerate(shown, 1)
        if place > len(before) or line != before[place - 1]
    )
