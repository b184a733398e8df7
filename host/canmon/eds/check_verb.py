"""The verb `eds check`: all findings of files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import click

from tickrig.host.canmon.eds_document import read_document
from tickrig.host.canmon.model.check.report import junit
from tickrig.host.canopen.data_sheet.check import check, failing, severities
from tickrig.host.canopen.data_sheet.rule import RULES, RuleFinding
from tickrig.host.cli.messages import Refused, refusing, until_unread
from tickrig.host.cli.options import PATH
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import check_file, check_not_read, write_whole

if TYPE_CHECKING:
    from tickrig.host.canopen.data_sheet.document import Document

_FOUND: Final = 1
"""Exit status where a finding counts."""


_UNREAD: Final = "unread"
"""The test case of a file that cannot be read."""


class _Case(NamedTuple):
    """A finding for the report: its rule, and the line that tells it."""

    rule: str
    text: str

    def __str__(self) -> str:
        """Return the line."""
        return self.text


@click.command()
@click.argument("file", nargs=-1, required=True, type=PATH)
@click.option("--strict", is_flag=True, help="Warnings count, too.")
@click.option("--json", "as_json", is_flag=True, help="Findings as JSON, one a line.")
@click.option("--junit", "report", type=PATH, metavar="FILE", help="Write a JUnit report.")
def command(file: Sequence[Path], strict: bool, as_json: bool, report: Path | None) -> None:
    """Tell all that is wrong in EDS files; exit status 1 if there is an error.

    A finding is a line: file, line, severity, rule, what came and what was allowed,
    what to do, and the clause that says so. Notes never count; warnings do with
    --strict. Exit status 2: a file cannot be read, or the report not be written.

    \b
    canmon eds check drive.eds
    canmon eds check *.eds *.xdd --strict --junit eds.xml
    canmon eds check drive.eds --json | jq .rule
    """  # noqa: D301 - click wants the backspace
    _check_report(report, file)
    documents, unread = _read(file)
    everything: list[RuleFinding] = []
    for document in documents:
        found = check(document)
        everything += found
        with until_unread():
            for one in found:
                click.echo(_finding_json(one) if as_json else str(one))
    failures = failing(everything, strict=strict)
    _write(report, documents, unread, failures)
    if documents:
        click.echo(f"{counted(len(documents), 'file')}: {severities(everything)}", err=True)
    if unread:
        click.get_current_context().exit(Refused.exit_code)
    if failures:
        click.get_current_context().exit(_FOUND)


def _read(files: Sequence[Path]) -> tuple[list[Document], list[_Case]]:
    """Read the files; what cannot be read is told, and is no reason to leave out the others."""
    documents, unread = [], []
    for path in files:
        try:
            documents.append(read_document(path))
        except Refused as error:
            error.show()
            unread.append(_Case(f"{path}: {_UNREAD}", error.message))
    return documents, unread


def _finding_json(one: RuleFinding) -> str:
    """Write a finding as an object."""
    said = {
        "v": 1,
        "file": one.file,
        "line": one.line,
        "severity": one.rule.severity.value,
        "rule": one.rule.name,
        "section": one.section,
        "text": one.text,
        "breaks": one.rule.breaks,
        "fix": one.rule.fix,
        "clause": one.rule.clause,
        "mended_by_fix": bool(one.edits),
    }
    return json_text(said, letters=True)


def _check_report(report: Path | None, files: Sequence[Path]) -> None:
    """See before the run whether the report could be written."""
    if report is not None:
        with refusing():
            check_file(report, "--junit")
            check_not_read(report, "--junit", files)


def _write(
    report: Path | None,
    documents: Sequence[Document],
    unread: Sequence[_Case],
    failures: Sequence[RuleFinding],
) -> None:
    """Write a test case for each rule of each file, and one for each that was not read."""
    if report is None:
        return
    cases = [*unread, *(_Case(f"{one.file}: {one.rule.name}", str(one)) for one in failures)]
    rules = (f"{document.name}: {name}" for document in documents for name in RULES)
    names = list(dict.fromkeys((*(case.rule for case in unread), *rules)))
    with refusing("--junit"):
        write_whole(report, junit("canmon eds check", names, cases))
