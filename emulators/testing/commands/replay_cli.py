"""The command `tickrig replay`."""

from __future__ import annotations

from pathlib import Path

import click

from tickrig.host.cli.options import PATH, run_code_option
from tickrig.host.cli.start import load


@click.command("replay")
@click.argument("file", type=PATH)
@click.option("-v", "--verbose", is_flag=True, help="Each device: its ticks, and what differs.")
@click.option(
    "--host",
    metavar="FILE.py:Class",
    help="FILE is a scenario that a search has found: do it with this BenchMachine.",
)
@run_code_option
@click.pass_context
def replay_command(
    context: click.Context, /, file: Path, *, verbose: bool, host: str | None, run_code: bool
) -> None:
    """Replay the trace FILE on fresh devices; exit status 1 if one says anything else.

    With --host a scenario of check_host is done again, with a fresh bench and host; exit status 1
    if something is still wrong.

    \b
    rrc-emu --link /tmp/rrc --trace run.trace
    tickrig replay run.trace
    tickrig replay found.txt --host test_chair.py:Chair
    """  # noqa: D301 - click wants the backspace
    module = "tickrig.emulators.testing.commands.replay"
    if host is not None:
        context.exit(load(f"{module}:replay_with_host")(file, host))
    context.exit(load(f"{module}:replay_trace")(file, verbose=verbose, run_code=run_code))
