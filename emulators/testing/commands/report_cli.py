"""The command `tickrig report`."""

from __future__ import annotations

from pathlib import Path

import click

from tickrig.host.cli.options import PATH, works_in


@click.command("report")
@click.argument("runs", metavar="RUN.json...", nargs=-1, required=True, type=PATH)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    required=True,
    type=PATH,
    help="Write an HTML page, or JSON if FILE ends in .json.",
)
@click.option("--title", default="", help="Title of the page.  [title of the first run]")
@works_in("tickrig.emulators.testing.commands.report:make_report")
def report_command(runs: tuple[Path, ...], output: Path, title: str) -> None:
    """Make one HTML page of test runs that were kept as JSON.

    \b
    tickrig report virtual.json -o bench.html
    tickrig report virtual.json real.json hardware.json -o bench.html --title "Friday"
    tickrig report virtual.json real.json -o both.json
    """  # noqa: D301 - click wants the backspace
