"""The command `tickrig replay`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.options import PATH, run_code_option, works_in


@click.command("replay")
@click.argument("file", type=PATH)
@click.option(
    "-v", "--verbose", is_flag=True, help="Show the ticks and the differences of each device."
)
@click.option(
    "--host",
    metavar="FILE.py:Class",
    help="Run FILE, a scenario that check_host has printed, with this BenchMachine.",
)
@run_code_option
@works_in("tickrig.emulators.testing.commands.replay:run_replay")
def replay_command(**options: Any) -> None:
    """Replay the trace FILE on fresh devices; the exit status is 1 if an output differs.

    With --host, FILE is a scenario that check_host, the search for errors of a host, has printed.
    The scenario runs again with a fresh bench and host. The exit status is 1 if the run still
    fails.

    \b
    rrc-emu --link /tmp/rrc --trace run.trace
    tickrig replay run.trace
    tickrig replay found.txt --host test_chair.py:Chair
    """  # noqa: D301 - click wants the backspace
