"""The command `tickrig report`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tickrig.host.cli.messages import Refused, refuse_path, say
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading

if TYPE_CHECKING:
    from tickrig.emulators.testing.report.bench_report import BenchReport


@click.command("report")
@click.argument("runs", metavar="RUN.json...", nargs=-1, required=True, type=PATH)
@click.option(
    "-o", "--output", metavar="FILE", required=True, type=PATH, help="The page; JSON as FILE.json."
)
@click.option("--title", default="", help="Of the page; that of the first run unless given.")
def report_command(runs: tuple[Path, ...], output: Path, title: str) -> None:
    """Make one HTML page of test runs that were kept as JSON.

    \b
    tickrig report virtual.json -o bench.html
    tickrig report virtual.json real.json hardware.json -o bench.html --title "Friday"
    tickrig report virtual.json real.json -o both.json
    """  # noqa: D301 - click wants the backspace
    with loading():
        from tickrig.emulators.testing.report.bench_report import (  # noqa: PLC0415 - slow
            merge_reports,
        )
        from tickrig.emulators.testing.report.report_file import (  # noqa: PLC0415
            check_report,
            write_report,
        )

    try:
        check_report(output)
    except ValueError as error:
        raise Refused(str(error)) from None
    report = merge_reports([_read(path) for path in runs], title)
    try:
        write_report(report, output)
    except OSError as error:
        refuse_path("report", error)
    tests = len(report.tests)
    say(f"{output}: {tests} {'test' if tests == 1 else 'tests'}")


def _read(path: Path) -> BenchReport:
    from tickrig.emulators.testing.report.report_file import read_run  # noqa: PLC0415 - slow

    try:
        return read_run(path)
    except OSError as error:
        refuse_path("run", error)
    except ValueError as error:
        raise Refused(f"run {path}: {error}") from None
