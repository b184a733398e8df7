"""Rules for EDS files, and their findings."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple


class Severity(Enum):
    """How severe a finding is."""

    ERROR = "error"
    """A tool misreads or refuses the file."""
    WARNING = "warning"
    """Tools interpret it differently."""
    NOTE = "note"
    """Style, or something optional."""


class _EdsRule(NamedTuple):
    """One rule.

    Attributes:
        name: as findings show it.
        severity: severity of its findings.
        clause: the document and clause that requires it; `practice` if there is none.
        breaks: the consequence of breaking it.
        fix: what to do.
    """

    name: str
    severity: Severity
    clause: str
    breaks: str
    fix: str


def read_rules(path: Path) -> dict[str, _EdsRule]:
    """Return the rules of a file by name, in its order.

    Args:
        path: a text file with a heading for each severity, as `[error]`, followed by one rule per
            line: name, clause, consequence and fix, separated by ` | `.
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
    """What an edit does."""

    REPLACE = "replace"
    AFTER = "after"
    ENCODING = "encoding"
    LINE_ENDS = "line ends"


class Edit(NamedTuple):
    """One edit of a file.

    Attributes:
        line: its number; 0 is before the first line.
        place: whether to replace the line, to insert lines after it, or to change the file as a
            whole.
        lines: the new lines, without line ends.
    """

    line: int
    place: EditPlace = EditPlace.REPLACE
    lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RuleFinding:
    """A violation of a rule.

    Attributes:
        rule: the rule.
        file: name of the file.
        line: its number, 0 for the file as a whole.
        section: empty outside of sections.
        text: the value in the file, and the allowed values.
        edits: the edits that fix the violation; empty if a fix needs knowledge of the device.
    """

    rule: _EdsRule
    file: str
    line: int
    section: str
    text: str
    edits: tuple[Edit, ...] = ()

    def __str__(self) -> str:
        """Return the finding in one line, in the format of compilers."""
        name, severity, clause, _, fix = self.rule
        where = f"[{self.section}] " if self.section else ""
        head = f"{self.file}:{max(self.line, 1)}: {severity.value}: [{name}] "
        return f"{head}{where}{self.text}; fix: {fix} ({clause})"


RULES: Final = read_rules(Path(__file__).with_name("rules.txt"))
"""The rules of `canmon eds check` by name, errors first."""
