"""Who sits at the terminal is told what to do, and asked what happened."""

from __future__ import annotations

from collections.abc import Callable
from typing import IO, Final

from tickrig.emulators.testing.bench.errors import NotOnThisBench, OperatorRefused
from tickrig.host.links.ready import ready
from tickrig.host.text.page_text import harmless

TERMINAL: Final = "/dev/tty"
POLL_US: Final = 10_000
DONE: Final = "then press Enter (n: not done, c: cannot be done)"


class Terminal:
    """Asks at the terminal of this process, whatever its standard input and output are.

    So tests may run with both caught. Hosts go on meanwhile.

    Args:
        path: of the terminal.

    Attributes:
        hosts: are called in turn with microseconds while an answer is awaited.
    """

    def __init__(self, path: str = TERMINAL) -> None:
        self._path = path
        self.hosts: list[Callable[[int], object]] = []

    def prompt(self, text: str) -> str:
        """Show a text and return the line that is typed.

        Raises:
            OperatorRefused: nobody is there.
        """
        try:
            with open(self._path, "r+b", buffering=0) as terminal:
                terminal.write(f"\n{harmless(text)} ".encode())
                while not self._is_typed(terminal):
                    for host in self.hosts:
                        host(POLL_US)
                line = terminal.readline()
        except OSError as error:
            raise OperatorRefused(f"nobody is at the terminal ({error.strerror})") from None
        if not line:
            raise OperatorRefused("nobody is at the terminal (end of input)")
        return line.decode("utf-8", "replace").strip()

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

    def _is_typed(self, terminal: IO[bytes]) -> bool:
        wait_s = 0 if self.hosts else POLL_US / 1e6
        return bool(ready([terminal], wait_s=wait_s)[0])
