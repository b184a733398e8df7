"""The command `tickrig run`: the bench of a rig file."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.options import PATH, time_option, works_in


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--virtual", is_flag=True, help="Run in virtual time, as fast as possible; needs --for."
)
@time_option("--for", "for_us", help="End after this time, such as 10s.  [at Ctrl-C]")
@click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'.")
@click.option("--trace", type=PATH, help="Record the run in a file, for 'tickrig replay'.")
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="[OWNER/]NAME[=ARGUMENT][@FROM[-TO]]",
    help="Add a fault of a device or a wire; may be repeated.",
)
@click.option(
    *("--plot", "plots"),
    multiple=True,
    metavar="SIGNALS",
    help="Draw signals after the run: x_m,y_m over time, x_m:y_m as a path; may be repeated.",
)
@click.option(
    *("-o", "files"),
    multiple=True,
    type=PATH,
    metavar="FILE",
    help="Write the plot to FILE: .png, .svg, .html or .csv.  [the terminal]",
)
@click.option("--report", type=PATH, metavar="FILE.html", help="Write a page about the run.")
@click.option("--seed", type=click.IntRange(0), help="Seed of all random values.  [that of FILE]")
@click.option("-v", "--verbose", count=True, help="Show events; -vv shows every line and frame.")
@works_in("tickrig.emulators.testing.commands.bench_run:run_bench")
def run(**options: Any) -> None:
    """Run the bench of a rig file: all its devices on one rig.

    In real time each serial line is at a pseudo-terminal, and at the links, network doors and CAN
    buses of the section [real]. A table shows the places. Real devices of the section [hardware]
    are not touched. The exit status is 2 if the file has errors, 3 if the recording is incomplete,
    and 130 if Ctrl-C ended a run in virtual time.

    A signal is an input or output that `tickrig ctl ... describe` lists, such as left/shaft_deg or
    left.shaft_deg, or shaft_deg if only one device has a signal of this name. A signal of the
    section [signal] has the name in the file. Ctrl-C ends the run; the curves and the page then
    show the run up to this time.

    \b
    tickrig run rig.toml --control /tmp/rig.ctl
    tickrig ctl /tmp/rig.ctl describe
    tickrig run rig.toml --virtual --for 10s --trace run.trace
    tickrig replay run.trace
    tickrig run rig.toml --virtual --for 10s --plot left/shaft_deg,right/shaft_deg
    tickrig run rig.toml --virtual --for 10s --plot x_m:y_m --plot speed_m_s -o run.png
    tickrig run rig.toml --virtual --for 10s --report run.html
    """  # noqa: D301 - click wants the backspace
