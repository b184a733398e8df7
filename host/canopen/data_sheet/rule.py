"""Rules for EDS files, and their findings."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple


class Severity(Enum):
    """How much a finding matters."""

    ERROR = "error"
    """A tool misreads or refuses the file."""
    WARNING = "warning"
    """Tools differ in what they make of it."""
    NOTE = "note"
    """Style, or something that may be left out."""


class _EdsRule(NamedTuple):
    """One rule.

    Attributes:
        name: as findings show it.
        severity: of its findings.
        clause: the document and clause that it is from; `practice` where none says it.
        breaks: what goes wrong where it is broken.
        fix: what to do, in words.
    """

    name: str
    severity: Severity
    clause: str
    breaks: str
    fix: str


def read_rules(path: Path) -> dict[str, _EdsRule]:
    """Return the rules of a file by name, in its order.

    Args:
        path: a text file with a heading for each severity, as `[error]`, and a rule a line below
            it: name, clause, what breaks and what to do, with ` | ` between them.
    """
    rules: dict[str, _EdsRule] = {}
    severity = Severity.ERROR
    for line in path.read_text("utf-8").splitlines():
        if line.startswith("["):
            severity = Severity(line.strip("[]"))
        elif line and not line.startswith("#"):
            name, *words = line.split(" | ")
            rules[name] = _EdsRule(name, severity, *words)
    return rules


class EditPlace(Enum):
    """What an edit does with a line."""

    REPLACE = "replace"
    AFTER = "after"
    ENCODING = "encoding"
    LINE_ENDS = "line ends"


class Edit(NamedTuple):
    """One change of a file.

    Attributes:
        line: its number; 0 stands before the first one.
        place: whether the line is replaced, or lines are put behind it; or the file as a whole.
        lines: what stands there then, without line ends.
    """

    line: int
    place: EditPlace = EditPlace.REPLACE
    lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RuleFinding:
    """What breaks a rule.

    Attributes:
        rule: which one.
        file: what the file is called.
        line: its number, 0 for the file as a whole.
        section: empty outside of one.
        text: what came, and what was allowed.
        edits: what mends it; empty where that takes knowledge of the device.
    """

    rule: _EdsRule
    file: str
    line: int
    section: str
    text: str
    edits: tuple[Edit, ...] = ()

    def __str__(self) -> str:
        """Say it in one line, as compilers do."""
        name, severity, clause, _, fix = self.rule
        where = f"[{self.section}] " if self.section else ""
        head = f"{self.file}:{max(self.line, 1)}: {severity.value}: [{name}] "
        return f"{head}{where}{self.text}; fix: {fix} ({clause})"


RULES: Final = read_rules(Path(__file__).with_name("rules.txt"))
"""Those of `canmon eds check` by name, errors first."""
