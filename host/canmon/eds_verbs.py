"""The verbs of `canmon eds`: check, fix, show, diff."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tickrig.host.canmon.eds_document import read_device_document, read_document
from tickrig.host.canmon.model.check.report import junit
from tickrig.host.canopen.data_sheet.check import check, failing, severities
from tickrig.host.canopen.data_sheet.fix import fix
from tickrig.host.canopen.data_sheet.rule import RULES, EditPlace, RuleFinding
from tickrig.host.canopen.data_sheet.show import diff, entries, head, pdos, table
from tickrig.host.cli.messages import Refused, refusing, say, until_unread
from tickrig.host.cli.options import PATH, Choice
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import check_file, check_not_read, write_whole
from tickrig.wire.canopen.eds.eds_file import shorten

if TYPE_CHECKING:
    from tickrig.host.canopen.data_sheet.document import Document


_FOUND: Final = 1
"""Exit status if a finding counts."""


_UNREAD: Final = "unread"
"""Name of the test case of a file that cannot be read."""


class _Case(NamedTuple):
    """A finding for the report, with its rule and its line."""

    rule: str
    text: str

    def __str__(self) -> str:
        """Return the line of the finding."""
        return self.text


@click.command()
@click.argument("file", nargs=-1, required=True, type=PATH)
@click.option("--strict", is_flag=True, help="Count warnings as errors.")
@click.option(
    "--jsonl", "--json", "as_json", is_flag=True, help="Print findings as JSON, one per line."
)
@click.option("--junit", "report", type=PATH, metavar="FILE", help="Write a JUnit report.")
def check_all(file: Sequence[Path], strict: bool, as_json: bool, report: Path | None) -> None:
    """Check EDS files and print all findings. The exit status is 1 if there is an error.

    A finding is a line with file, line, severity, rule, the value and the allowed values, the fix,
    and the clause of the standard. The severity is error, warning or note. With --strict, the exit
    status is also 1 if there is a warning. Notes do not change the exit status. The exit status is
    2 if a file cannot be read, or if the report cannot be written.

    \b
    canmon eds check drive.eds
    canmon eds check *.eds *.xdd --strict --junit eds.xml
    canmon eds check drive.eds --jsonl | jq .rule
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
    """Read the files. Report unreadable files, and continue with the other files."""
    documents, unread = [], []
    for path in files:
        try:
            documents.append(read_document(path))
        except Refused as error:
            error.show()
            unread.append(_Case(f"{path}: {_UNREAD}", error.message))
    return documents, unread


def _finding_json(one: RuleFinding) -> str:
    """Return a finding as a JSON object."""
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
    """Check before the run that the report can be written."""
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
    """Write a test case for each rule of each file, and for each file that cannot be read."""
    if report is None:
        return
    cases = [*unread, *(_Case(f"{one.file}: {one.rule.name}", str(one)) for one in failures)]
    rules = (f"{document.name}: {name}" for document in documents for name in RULES)
    names = list(dict.fromkeys((*(case.rule for case in unread), *rules)))
    with refusing("--junit"):
        write_whole(report, junit("canmon eds check", names, cases))


# The verb `eds fix`, which fixes errors that need no knowledge of the device.


_LEFT: Final = 1
"""Exit status if errors remain that need knowledge of the device."""


@click.command()
@click.argument("file", type=PATH)
@click.option("-o", "--output", type=PATH, metavar="OUT", help="Write to OUT, which may be FILE.")
@click.option("--dry-run", is_flag=True, help="Show the changes; write nothing.")
@click.option(
    "--encoding",
    type=Choice(("utf-8", "ascii")),
    default="utf-8",
    help="Encoding of OUT if FILE is not ASCII; ascii writes ö as oe. [utf-8]",
)
@click.option(
    "--from-encoding",
    metavar="NAME",
    default="",
    help="Encoding of FILE if not Unicode, such as cp1252 or cp850. [guessed]",
)
def mend(file: Path, output: Path | None, dry_run: bool, encoding: str, from_encoding: str) -> None:
    """Fix an EDS. The exit status is 1 if errors or warnings are left.

    Lines without a finding are unchanged to the byte, unless the file is not Unicode. Such a file
    becomes UTF-8, and the assumed encoding is printed. XDD files cannot be fixed.

    The command prints each fix with its line number in FILE. The command also prints the findings
    that are left, because their fix needs knowledge of the device. These findings have their line
    number in OUT, the file of -o, or in FILE with --dry-run.

    \b
    canmon eds fix drive.eds -o fixed.eds
    canmon eds fix drive.eds --dry-run
    canmon eds fix drive.eds -o fixed.eds --from-encoding cp850
    """  # noqa: D301 - click wants the backspace
    if (output is None) is not dry_run:
        raise Refused("give -o OUT, or --dry-run")
    document = _mendable(file, _known(from_encoding))
    fixed = fix(document, ascii_only=encoding == "ascii")
    with until_unread():
        if dry_run:
            for line in _differences(document, fixed.document):
                click.echo(line)
        for one in fixed.mended:
            click.echo(_mended(one))
        for one in fixed.left:
            click.echo(str(fixed.before(one) if output is None else replace(one, file=str(output))))
    if output is not None:
        with refusing("-o", path=output):
            write_whole(output, fixed.document.data)
    say(f"{len(fixed.mended)} fixed, {len(fixed.left)} left")
    if fixed.left:
        click.get_current_context().exit(_LEFT)


def _known(encoding: str) -> str:
    """Return the name of an encoding of texts, or empty. Raise Refused if the name is unknown."""
    try:
        b"a".decode(encoding or "ascii")
    except LookupError:
        text = f"--from-encoding {encoding!r} is no encoding, as cp1252, cp850 or latin-1"
        raise Refused(text) from None
    return encoding


def _mendable(file: Path, encoding: str) -> Document:
    """Read a file that can be fixed. Raise Refused if it is XML or describes no object."""
    document = read_document(file, encoding=encoding)
    if document.file.is_xml:
        raise Refused(f"FILE {file}: XDD files cannot be fixed")
    if not document.rows:
        raise Refused(f"FILE {file}: no EDS: it describes no object")
    return document


def _mended(one: RuleFinding) -> str:
    """Print the fixed findings and the text that replaces them."""
    lines = [text for edit in one.edits for text in edit.lines if text]
    more = f" and {len(lines) - 1} more" if lines[1:] else ""
    left_out = any(edit.place is EditPlace.REPLACE for edit in one.edits)
    now = f"; now {shorten(lines[0].strip())}{more}" if lines else "; left out" * left_out
    where = f"[{one.section}] " if one.section else ""
    return f"{one.file}:{max(one.line, 1)}: fixed: [{one.rule.name}] {where}{one.text}{now}"


def _differences(old: Document, new: Document) -> Iterator[str]:
    """Yield the lines that differ, as `diff -u` does. Unprintable characters become ?."""
    lines = difflib.unified_diff(old.texts, new.texts, old.name, new.name, n=1, lineterm="")
    for line in lines:
        yield "".join(letter if letter.isprintable() else "?" for letter in line)


# The verb `eds show`: the device of a file.


_PLACE: Final = re.compile(r"(?:0x)?([0-9a-f]{4})h?(?::(?:0x)?([0-9a-f]{1,2})h?)?", re.IGNORECASE)
_COLUMNS: Final = ("index", "sub", "type", "access", "default", "low", "high", "name")


@click.command()
@click.argument("file", type=PATH)
@click.argument("place", required=False, metavar="[INDEX[:SUB]]")
@click.option("--node", type=click.IntRange(1, 127), default=1, help="Node-ID of the PDOs.  [1]")
@click.option("--json", "as_json", is_flag=True, help="Print everything as one JSON object.")
def show(file: Path, place: str | None, node: int, as_json: bool) -> None:
    """Show the device of an EDS: head, objects, PDOs at power-on.

    Index and sub-index are hexadecimal. In the column access, T means that a TPDO may carry the
    entry, and R means that an RPDO may carry the entry.

    \b
    canmon eds show drive.eds
    canmon eds show drive.eds 6040
    canmon eds show drive.eds 1018:01 --json
    """  # noqa: D301 - click wants the backspace
    index, sub = _place(place)
    said = _describe(read_device_document(file), index, sub, node)
    if index is not None and not said["entries"]:
        raise Refused(f"{file}: no {place} is there")
    with until_unread():
        for line in [json_text(said, letters=True)] if as_json else _lines(said, node):
            click.echo(line)


def _place(text: str | None) -> tuple[int | None, int | None]:
    if text is None:
        return None, None
    match = _PLACE.fullmatch(text)
    if match is None:
        raise Refused(f"{text!r} is not INDEX or INDEX:SUB in hexadecimal, as 6040 or 1018:01")
    return int(match[1], 16), int(match[2], 16) if match[2] else None


def _describe(
    document: Document, index: int | None, sub: int | None, node_id: int
) -> dict[str, Any]:
    """Return the data to show. For a single object, head and PDOs are omitted."""
    said: dict[str, Any] = {"v": 1, "file": document.name}
    if index is None:
        said["device"] = head(document)
    said["entries"] = entries(document, index, sub)
    if index is None:
        said["pdos"] = pdos(document, node_id)
    return said


def _lines(said: dict[str, Any], node_id: int) -> Iterator[str]:
    for what, value in said.get("device", {}).items():
        if value != "":
            yield f"{what:<14}{value}"
    if "device" in said:
        yield ""
    yield from table(said["entries"], _COLUMNS)
    if said.get("pdos"):
        yield ""
        yield f"PDOs of node {node_id}"
    for pdo in said.get("pdos", ()):
        yield from _pdo_lines(pdo)


def _pdo_lines(pdo: dict[str, Any]) -> Iterator[str]:
    state = "" if pdo["valid"] else ", not valid"
    yield f"{pdo['pdo']:<8}{pdo['can_id']}  type {pdo['transmission']}{state}"
    for each in pdo["mapping"]:
        bits = f"{each['bit']}..{each['bit'] + each['bits'] - 1}"
        yield f"        {bits:<8}{each['object']} {each['name']}".rstrip()


# The verb `eds diff`: differences between devices.


_DIFFERENT: Final = 1


@click.command()
@click.argument("old", type=PATH)
@click.argument("new", type=PATH)
@click.option(
    "--jsonl", "--json", "as_json", is_flag=True, help="Print differences as JSON, one per line."
)
def compare(old: Path, new: Path, as_json: bool) -> None:
    """Compare the devices of two EDS files. The exit status is 1 if they differ.

    The command compares objects, entries and their fields, identity and bit rates. The command
    ignores what does not concern the device: dates, file names, comments, the order of sections and
    the notation of numbers. In the output, - marks items only in the first file, + marks items only
    in the second file, and ~ marks differences.

    \b
    canmon eds diff old.eds new.eds
    canmon eds diff drive.eds drive.xdd --jsonl
    """  # noqa: D301 - click wants the backspace
    changes = diff(read_device_document(old), read_device_document(new))
    with until_unread():
        for change in changes:
            said = {"v": 1, **change._asdict()}
            click.echo(json_text(said, letters=True) if as_json else str(change))
    if changes:
        click.get_current_context().exit(_DIFFERENT)
