"""Who sits at the terminal is told what to do, and asked what happened."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Final

from tickrig.emulators.testing.bench.errors import NotOnThisBench, OperatorRefused

POLL_US: Final = 10_000
DONE: Final = "then press Enter (n: not done, c: cannot be done)"


class Terminal:
    """Asks at standard input and output; hosts go on meanwhile.

    Args:
        opened: makes a context in which both are the terminal, where tests run with them caught.

    Attributes:
        hosts: are called in turn with microseconds while an answer is awaited.
    """

    def __init__(self, opened: Callable[[], AbstractContextManager[object]] = nullcontext) -> None:
        self._opened = opened
        self.hosts: list[Callable[[int], object]] = []

    def prompt(self, text: str) -> str:
        """Show a text and return the line that is typed.

        Raises:
            OperatorRefused: nobody is there.
        """
        with self._opened():
            sys.stdout.write(f"\n{text} ")
            sys.stdout.flush()
            while not self._is_typed():
                for host in self.hosts:
                    host(POLL_US)
            line = sys.stdin.readline()
        if not line:
            raise OperatorRefused("nobody is at the terminal (end of input)")
        return line.strip()

    def have_done(self, text: str) -> None:
        """Ask for something to be done.

        Args:
            text: what, as a sentence without its end.

        Raises:
            OperatorRefused: it was not done.
            NotOnThisBench: it cannot be done.
        """
        while answer := self.prompt(f"{text}, {DONE}:").lower():
            if answer == "n":
                raise OperatorRefused(f"the operator did not do this: {text}")
            if answer == "c":
                raise NotOnThisBench(f"the operator cannot do this: {text}")

    def sees(self, question: str) -> bool:
        """Ask a question that is answered by yes or no."""
        while (answer := self.prompt(f"{question} [y/n]").lower()) not in ("y", "n"):
            continue
        return answer == "y"

    def _is_typed(self) -> bool:
        wait_s = 0 if self.hosts else POLL_US / 1e6
        return bool(select.select([sys.stdin], [], [], wait_s)[0])
