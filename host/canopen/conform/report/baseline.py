"""Known failures, to tell new failures from known ones.

A baseline is a text file with the id of one check per line. `#` starts a comment.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tickrig.host.canopen.conform import verdict
from tickrig.host.text.page_text import one_line

_HEAD: Final = "# known failures of a conformance run (canmon conform --baseline)"
_MOST_BYTES: Final = 10_000_000
_LONGEST: Final = 80
"""Length of the longest id. The ids of the suite are at most half as long."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """The known failures.

    Attributes:
        known: ids of checks.
    """

    known: frozenset[str] = frozenset()

    @classmethod
    def read(cls, path: Path) -> Baseline:
        """Read a baseline file, which lists the checks whose failures are known.

        Raises:
            OSError: the file cannot be read.
            ValueError: the file is not a baseline. The message contains the line and the reason.
        """
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
        if len(data) > _MOST_BYTES:
            raise ValueError(f"{path} has more than {_MOST_BYTES} bytes: not a baseline")
        try:
            lines = data.decode("utf-8-sig").splitlines()
        except UnicodeDecodeError as error:
            raise ValueError(f"{path} is not a text: byte {error.start} is not UTF-8") from None
        return cls(frozenset(filter(None, (_id(path, *each) for each in enumerate(lines, 1)))))

    def knows(self, result: verdict.Result) -> bool:
        """Return whether a result is a known failure."""
        return result.outcome.verdict is verdict.CheckVerdict.FAIL and result.check.id in self.known

    def new(self, report: verdict.Report) -> list[verdict.Result]:
        """Return the failures that are not in the baseline."""
        failed = report.with_verdict(verdict.CheckVerdict.FAIL)
        return [result for result in failed if not self.knows(result)]

    def mended(self, report: verdict.Report) -> list[str]:
        """Return the ids of known failures that pass now."""
        passed = report.with_verdict(verdict.CheckVerdict.PASS)
        return sorted(self.known.intersection(result.check.id for result in passed))

    def exit_status(self, report: verdict.Report) -> int:
        """Return the exit status of a run, in which known failures do not count."""
        return report.exit_status_with(len(self.new(report)))

    def ends_with(self, report: verdict.Report) -> int:
        """Return the exit status of `canmon conform`. Known failures do not count as failures.

        If the run ended early, the result is `verdict.CTRL_C` after Ctrl-C, and
        `verdict.BUS_FAILED` after a failure of the bus.
        """
        if report.aborted and not report.absent:
            return verdict.CTRL_C if report.aborted == verdict.INTERRUPTED else verdict.BUS_FAILED
        return self.exit_status(report)


NONE_KNOWN: Final = Baseline()


def baseline_text(report: verdict.Report) -> str:
    """Return a baseline file that lists all failures of a report as known, by check id."""
    failed = {
        result.check.id: f"{result.check.id}  # {one_line(result.check.title)}"
        for result in report.with_verdict(verdict.CheckVerdict.FAIL)
    }
    return "\n".join([_HEAD, *(failed[name] for name in sorted(failed)), ""])


def _id(path: Path, number: int, line: str) -> str:
    name = line.partition("#")[0].strip()
    if len(name) > _LONGEST or len(name.split()) > 1 or not name.isascii():
        shown = one_line(name)
        raise ValueError(f"{path}, line {number}: {shown[:_LONGEST]!r} is not the id of a check")
    return name
