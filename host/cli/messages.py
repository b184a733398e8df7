"""Messages of commands on standard error, which are remarks, warnings and refusals."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, NoReturn

import click

from tickrig.host.cli.start import FULL, raise_of_output

if TYPE_CHECKING:
    from pathlib import Path

    from tickrig.wire.canopen.eds.eds_file import Finding


# Messages for requests that a command cannot execute.

NEEDS_YAML: Final = "a System Definition needs PyYAML: pip install 'tickrig[rtc]'"


class Refused(click.ClickException):
    """The command refuses its input: one line on standard error, and exit status 2."""

    exit_code = 2


class SourceFailed(click.ClickException):
    """Raised if a bus, a file or a disk fails. The command ends with one line and status 3."""

    exit_code = 3


@contextmanager
def refused_at(option: str) -> Iterator[None]:
    """Turn a ValueError of the block into Refused, with the name of the option."""
    try:
        yield
    except ValueError as error:
        raise Refused(f"{option}: {error}") from None


@contextmanager
def failing(*errors: type[Exception]) -> Iterator[None]:
    """Context manager that turns errors of its block into a ClickException (exit status 1).

    An error of a process that the command started may have an attribute `status`, the exit status
    of that process. If `status` is 3, the error becomes SourceFailed, so the command also ends with
    exit status 3. Errors in writing standard output are not changed.
    """
    try:
        yield
    except errors as error:
        raise_of_output(error)
        bus_failed = getattr(error, "status", 1) == SourceFailed.exit_code
        raise (SourceFailed if bus_failed else click.ClickException)(str(error)) from error


def refuse_path(what: str, error: OSError) -> NoReturn:
    """Raise Refused for an unusable path, with the reason."""
    path = error.filename2 or error.filename
    named = what if path is None else f"{what} {path}"
    raise Refused(f"{named}: {error.strerror or error}") from error


@contextmanager
def refusing(
    what: str = "", wrong: type[ValueError] = ValueError, *, path: Path | None = None
) -> Iterator[None]:
    """Context manager that turns errors of its block into Refused, which ends the command.

    The message consists of `what`, `path` if it is not None, and the text of the error. For an
    OSError, it consists of `what`, the path in the error, and the reason.

    Args:
        what: invalid option or argument.
        wrong: class of the errors to turn into Refused. Each OSError is turned into Refused too.
        path: file that contains the error. Use None if the text of the error names the file.
    """
    try:
        yield
    except OSError as error:
        refuse_path(what, error)
    except wrong as error:
        what += f" {path}:" if path else ""
        raise Refused(f"{what} {error}".lstrip()) from None


def time_us(option: str, word: str) -> int:
    """Parse the time in an option such as `--wait`. Return it in microseconds.

    Raises:
        Refused: the text is not a time.
    """
    from tickrig.host.text.values import parse_time_us  # noqa: PLC0415 - a TAB needs none

    with refused_at(option):
        return parse_time_us(word)


# Messages of commands on standard error: remarks, warnings, faults of EDS files.


def say(text: str) -> None:
    """Print a message on standard error, because standard output is for programs."""
    click.echo(text, err=True)


@contextmanager
def warnings_shown() -> Iterator[None]:
    """Context manager that prints the warnings of the library on standard error, one per line.

    Without it, the warnings are not printed.
    """
    import logging  # noqa: PLC0415 - slow, and a TAB needs none

    logger, handler = logging.getLogger("tickrig"), logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


def show_findings(findings: Iterable[Finding]) -> None:
    """Print the findings in EDS files. Print a finding in many sections only once."""
    from tickrig.wire.canopen.eds.eds_file import finding_lines  # noqa: PLC0415 - a TAB needs none

    for line in finding_lines(findings):
        say(line)


@contextmanager
def until_unread() -> Iterator[None]:
    """Context manager that ends its block without a message if nothing reads standard output.

    For example, nothing reads it any more after `| head` has printed its lines.

    Raises:
        SourceFailed: standard output cannot be written, for example because the disk is full.
    """
    try:
        yield
    except BrokenPipeError:
        _leave()
    except OSError as error:
        if error.errno not in FULL:
            raise
        _leave()
        raise SourceFailed(f"standard output: {error.strerror or error}") from error


def _leave() -> None:
    """Discard output that is still to be flushed, also at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
