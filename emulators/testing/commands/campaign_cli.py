"""The command `tickrig campaign`: run a test with thousands of seeds, and join its shards."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.options import PATH, time_option, works_in

_RUN: Final = "run"
_OUTPUT: Final = "Write the table to a .csv or .parquet file; may be repeated."


class _CampaignGroup(click.Group):
    """A group with a default command: `tickrig campaign tests --seeds 0-9`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the words after the command; words without a command name are for `run`."""
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            args = [_RUN, *args]
        return super().parse_args(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[Any]:
        """Complete commands, and the arguments of `run`."""
        run = self.commands[_RUN]
        with run.make_context(_RUN, [], parent=ctx, resilient_parsing=True) as own:
            return [
                *super().shell_complete(ctx, incomplete),
                *run.shell_complete(own, incomplete),
                *run.params[0].shell_complete(own, incomplete),
            ]


@click.group(cls=_CampaignGroup)
def campaign() -> None:
    """Run bench tests with many seeds and parameters, on all cores or a cluster.

    \b
    tickrig campaign tests/test_stop.py --seeds 0-9999
    tickrig campaign tests/test_stop.py::test_it_stops --seeds 0-999 --param flip=0.0001,0.001
    tickrig campaign tests --seeds 0-9999 --shard 3/8 -o part3.csv
    tickrig campaign tests --seeds 0-9999 --scheduler tcp://10.0.0.5:8786
    tickrig campaign merge part1.csv part2.csv -o all.csv

    The word run may be omitted: see 'tickrig campaign run --help' for the options. After Ctrl-C or
    a kill the same command continues where it ended.
    """  # noqa: D301 - click wants the backspace


@campaign.command(_RUN)
@click.argument("tests", nargs=-1, required=True, type=click.Path())
@click.option("--seeds", required=True, help="Seeds, such as 0-9999 or 3,17,100-199.")
@click.option(
    "--param",
    "parameters",
    multiple=True,
    metavar="NAME=V,V",
    help="Run all seeds with each value of the argument or fixture NAME; may be repeated.",
)
@click.option(
    "--shard",
    default="1/1",
    metavar="K/N",
    help="Do only part K of N parts of the runs, such as 3/8.",
)
@click.option(
    "-o", "--output", "outputs", multiple=True, type=PATH, help=_OUTPUT + "  [campaign.csv]"
)
@click.option(
    "-j", "--workers", type=click.IntRange(1, 1000), help="Number of processes. [one per core]"
)
@time_option("--timeout", "timeout_us", default="60s", help="Time-out of a run. [60s]")
@click.option("--bench", default="", metavar="RIG.TOML", help="Rig file of the bench.")
@click.option(
    "-k", "keyword", default="", metavar="EXPRESSION", help="Select tests by name, as in pytest."
)
@click.option("--scheduler", default="", metavar="URL", help="Run on the Dask cluster at URL.")
@click.option("--fresh", is_flag=True, help="Start again, and replace earlier results.")
@works_in("tickrig.emulators.testing.commands.campaign_run:run")
def run(**options: Any) -> None:
    """Run TESTS (files, folders, node IDs) with each seed and each --param value, in virtual time.

    The exit status is 1 if a run did not pass, and 3 if the disk is full.

    \b
    tickrig campaign tests/test_stop.py --seeds 0-9999 --param flip=0.0001,0.001
    tickrig campaign tests/test_stop.py --seeds 0-99 -o runs.csv -o runs.parquet
    """  # noqa: D301 - click wants the backspace


@campaign.command()
@click.argument("tables", metavar="TABLE...", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", "outputs", multiple=True, required=True, type=PATH, help=_OUTPUT)
@works_in("tickrig.emulators.testing.commands.campaign_run:merge")
def merge(tables: tuple[Path, ...], outputs: tuple[Path, ...]) -> None:
    """Join the tables of shards, and print their summary.

    \b
    tickrig campaign merge part1.csv part2.csv -o all.csv
    tickrig campaign merge part*.parquet -o all.csv -o all.parquet
    """  # noqa: D301 - click wants the backspace
