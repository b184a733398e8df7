"""The command `tickrig run`: the bench of a rig file."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.options import PATH, time_option, works_in


@click.command()
@click.argument("file", type=PATH)
@click.option("--virtual", is_flag=True, help="In virtual time, as fast as it goes; wants --for.")
@time_option("--for", "for_us", help="How long, as 10s.  [until Ctrl-C]")
@click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'.")
@click.option("--trace", type=PATH, help="File to record the run in, for 'tickrig replay'.")
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="[OWNER/]NAME[=ARGUMENT][@FROM[-TO]]",
    help="One more fault of a device or a wire; may be repeated.",
)
@click.option("--seed", type=click.IntRange(0), help="Seed of all chance.  [that of FILE]")
@click.option("-v", "--verbose", count=True, help="Show events; -vv shows every line and frame.")
@works_in("tickrig.emulators.testing.commands.bench_run:run_bench")
def run(**options: Any) -> None:
    """Run the bench of a rig file: all its devices on one rig.

    In real time each serial line is at a pseudo-terminal, and at the links, network
    doors and CAN buses of the section [real]; a table says where. Real devices of the section
    [hardware] are not touched. Exit status 2 if the file has mistakes, 3 if the recording
    is not whole.

    \b
    tickrig run rig.toml --control /tmp/rig.ctl
    tickrig ctl /tmp/rig.ctl describe
    tickrig run rig.toml --virtual --for 10s --trace run.trace
    tickrig replay run.trace
    """  # noqa: D301 - click wants the backspace
