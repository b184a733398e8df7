"""What is wrong in an EDS or DCF, and where."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

LONGEST: Final = 40


class Finding(NamedTuple):
    """A fault of a file.

    Attributes:
        file: what the file is called.
        section: without brackets, empty for the file as a whole.
        reason: which key or line, what it says, and what was allowed or is taken instead.
    """

    file: str
    section: str
    reason: str

    def __str__(self) -> str:
        """Say it in one line."""
        where = f"[{self.section}] " if self.section else ""
        return f"{self.file}: {where}{self.reason}"


class EdsError(ValueError):
    """An EDS that cannot be used: all that is wrong with it, a line each."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(map(str, self.findings)))


def shorten(text: str) -> str:
    """Return a text of a file so that it fits into a line.

    >>> shorten("a" * 99) == "a" * 37 + "..."
    True
    """
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
