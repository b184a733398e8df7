"""Rules for EDS files, and their findings."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple


class Severity(Enum):
    """Severity of a finding."""

    ERROR = "error"
    """A tool misreads or refuses the file."""
    WARNING = "warning"
    """Tools interpret the file differently."""
    NOTE = "note"
    """The finding is about style or something optional."""


class _EdsRule(NamedTuple):
    """One rule for EDS files.

    Attributes:
        name: name of the rule, as findings show it.
        severity: severity of the rule's findings.
        clause: document and clause that requires the rule, or `practice` if there is none.
        breaks: consequence of breaking the rule.
        fix: instruction that fixes a finding.
    """

    name: str
    severity: Severity
    clause: str
    breaks: str
    fix: str


def read_rules(path: Path) -> dict[str, _EdsRule]:
    """Read the descriptions of EDS rules from a text file. Return them by name, in file order.

    Args:
        path: text file with a heading for each severity, such as `[error]`. Each line below a
            heading describes a rule by its name, clause, consequence and fix, separated by ` | `.
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
    """The effect of an edit on a line."""

    REPLACE = "replace"
    AFTER = "after"
    ENCODING = "encoding"
    LINE_ENDS = "line ends"


class Edit(NamedTuple):
    """One change to the lines of an EDS that corrects a finding.

    Attributes:
        line: number of the line, from 1. 0 stands for the place before the first line.
        place: place of the new lines: instead of the line, after the line, or instead of the whole
            file.
        lines: new lines, without line ends.
    """

    line: int
    place: EditPlace = EditPlace.REPLACE
    lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RuleFinding:
    """One violation of a rule in an EDS or a bus.yml, with its position.

    Attributes:
        rule: rule that is violated.
        file: name of the file.
        line: line number, or 0 for the file as a whole.
        section: title of the section, empty outside of sections.
        text: invalid value, and the allowed values.
        edits: edits that correct the violation. There are none if a correction needs knowledge
            about the device.
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
"""Rules of `canmon eds check` by name. Rules for errors come first."""
