"""The command `tickrig run`: the bench of a rig file."""

from __future__ import annotations

from pathlib import Path

import click

from tickrig.host.cli.messages import Refused, refuse_path, say
from tickrig.host.cli.options import PATH, time_option
from tickrig.host.cli.start import loading

_MISTAKES = 2


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
@click.pass_context
def run(  # noqa: PLR0913 - options
    context: click.Context,
    /,
    file: Path,
    *,
    virtual: bool,
    for_us: int | None,
    control: Path | None,
    trace: Path | None,
    faults: tuple[str, ...],
    seed: int | None,
    verbose: int,
) -> None:
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
    if virtual and for_us is None:
        raise Refused("--virtual wants a time: --for 10s")
    if virtual and control is not None:
        raise Refused("--control belongs to real time, not to --virtual")
    with loading():
        from dataclasses import replace  # noqa: PLC0415 - slow

        from tickrig.emulators.commands.run import mistakes_in  # noqa: PLC0415 - slow
        from tickrig.emulators.testing.commands.bench_run import BenchOptions, BenchRun  # noqa: PLC0415 - slow
        from tickrig.emulators.testing.rig_file.reader import read_rig_file  # noqa: PLC0415
        from tickrig.emulators.testing.rig_file.schema import RigFileError  # noqa: PLC0415

    try:
        plan = read_rig_file(file)
    except RigFileError as error:
        say(str(error))
        context.exit(_MISTAKES)
    except OSError as error:
        refuse_path("file", error)
    plan = plan if seed is None else replace(plan, seed=seed)
    options = BenchOptions(
        virtual=virtual,
        for_us=for_us,
        control=None if virtual else control or plan.real.control,
        trace=trace,
        faults=faults,
        verbose=verbose,
    )
    with mistakes_in(each.type for each in plan.devices.values()):
        context.exit(BenchRun(plan, options).run())
