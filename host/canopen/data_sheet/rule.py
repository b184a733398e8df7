"""What a rule for EDS files is, and what it finds."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple


class Severity(Enum):
    """How much a finding matters."""

    ERROR = "error"
    """A tool misreads or refuses the file."""
    WARNING = "warning"
    """Tools differ in what they make of it."""
    NOTE = "note"
    """Style, or something that may be left out."""


class Rule(NamedTuple):
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


Rules = tuple[tuple[str, str, str, str], ...]
"""Name, clause, what breaks, what to do."""


def rules_of(errors: Rules, warnings: Rules, notes: Rules) -> dict[str, Rule]:
    """Return rules by name, in the order of their severity."""
    tables = zip(Severity, (errors, warnings, notes), strict=True)
    return {
        name: Rule(name, severity, clause, breaks, fix)
        for severity, rules in tables
        for name, clause, breaks, fix in rules
    }


class Place(Enum):
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
    place: Place = Place.REPLACE
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

    rule: Rule
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
