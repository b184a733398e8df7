"""The verb `eds fix`: what needs no knowledge of the device is mended."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from tickrig.host.canmon.eds_document import read_document
from tickrig.host.canopen.data_sheet.fix import fix
from tickrig.host.canopen.data_sheet.rule import EditPlace, RuleFinding
from tickrig.host.cli.messages import Refused, refuse_path, say, until_unread
from tickrig.host.cli.options import PATH
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.canopen.eds.eds_file import shorten

if TYPE_CHECKING:
    from tickrig.host.canopen.data_sheet.document import Document

_LEFT: Final = 1
"""Exit status where something is left that needs knowledge of the device."""


@click.command()
@click.argument("file", type=PATH)
@click.option("-o", "--output", type=PATH, metavar="OUT", help="Where it is written; may be FILE.")
@click.option("--dry-run", is_flag=True, help="Show the lines that would change; write nothing.")
@click.option(
    "--encoding",
    type=click.Choice(("utf-8", "ascii")),
    default="utf-8",
    help="Of OUT, where letters beyond ASCII are in FILE; ascii writes ö as oe.  [utf-8]",
)
@click.option(
    "--from-encoding",
    metavar="NAME",
    default="",
    help="Of FILE, where its bytes are no Unicode, as cp1252 or cp850.  [guessed]",
)
def command(
    file: Path, output: Path | None, dry_run: bool, encoding: str, from_encoding: str
) -> None:
    """Mend an EDS; exit status 1 if errors or warnings are left.

    Lines that no finding names stay to the byte, unless the file is not Unicode: then
    it becomes UTF-8, and what a byte is taken for is told. What is mended, with the lines
    of FILE, and what is left as it needs knowledge of the device, with those of OUT, is
    told. XDD files are not mended.

    \b
    canmon eds fix drive.eds -o mended.eds
    canmon eds fix drive.eds --dry-run
    canmon eds fix drive.eds -o mended.eds --from-encoding cp850
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
        _write(output, fixed.document.data)
    say(f"{len(fixed.mended)} mended, {len(fixed.left)} left")
    if fixed.left:
        click.get_current_context().exit(_LEFT)


def _known(encoding: str) -> str:
    """Return the name of an encoding of texts, or empty; Refused if there is none of that name."""
    try:
        b"a".decode(encoding or "ascii")
    except LookupError:
        text = f"--from-encoding {encoding!r} is no encoding, as cp1252, cp850 or latin-1"
        raise Refused(text) from None
    return encoding


def _mendable(file: Path, encoding: str) -> Document:
    """Read a file that can be mended; Refused if it is XML, or describes no object."""
    document = read_document(file, encoding=encoding)
    if document.file.is_xml:
        raise Refused(f"FILE {file}: XDD files are not mended")
    if not document.rows:
        raise Refused(f"FILE {file}: no EDS: it describes no object")
    return document


def _mended(one: RuleFinding) -> str:
    """Say what was mended, and what is written instead."""
    lines = [text for edit in one.edits for text in edit.lines if text]
    more = f" and {len(lines) - 1} more" if lines[1:] else ""
    left_out = any(edit.place is EditPlace.REPLACE for edit in one.edits)
    now = f"; now {shorten(lines[0].strip())}{more}" if lines else "; left out" * left_out
    where = f"[{one.section}] " if one.section else ""
    return f"{one.file}:{max(one.line, 1)}: mended: [{one.rule.name}] {where}{one.text}{now}"


def _differences(old: Document, new: Document) -> Iterator[str]:
    """Give the lines that differ, as `diff -u`; what cannot be printed as ?."""
    lines = difflib.unified_diff(old.texts, new.texts, old.name, new.name, n=1, lineterm="")
    for line in lines:
        yield "".join(letter if letter.isprintable() else "?" for letter in line)


def _write(output: Path, data: bytes) -> None:
    try:
        write_whole(output, data)
    except OSError as error:
        refuse_path("-o", error)
    except ValueError as error:
        raise Refused(f"-o {output}: {error}") from None
