"""The verb `conform`, which judges one CANopen node, clause by clause."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.messages import until_unread
from tickrig.host.cli.options import PATH, Decorator, add_options, refuse_idle
from tickrig.host.cli.start import loading

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from tickrig.host.canmon import eds_document
    from tickrig.host.canmon.conform import chosen, conformance
    from tickrig.host.canopen.conform import suite
else:  # slow
    chosen = LazyModule("tickrig.host.canmon.conform.chosen")
    conformance = LazyModule("tickrig.host.canmon.conform.conformance")
    eds_document = LazyModule("tickrig.host.canmon.eds_document")
    suite = LazyModule("tickrig.host.canopen.conform.suite")


_LEVELS: Final = ("read-only", "communication", "intrusive")
"""Names of the levels in the order of `Level`."""


_LEAST_LOAD: Final = 1
"""Smallest load in percent. With a smaller load, an answer takes longer than a check may."""


class _Percent(click.FloatRange):
    """A share in percent. `nan`, which is in no range, is refused too."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number."""
        number = float(super().convert(value, param, ctx))
        if isnan(number):
            self.fail(f"{value} is no number from {self.min:g} to {self.max:g}", param, ctx)
        return number


def _complete_only(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem  # noqa: PLC0415 - only at a TAB

    with loading():
        names = [
            (name, title)
            for group in suite.read_suite()
            for name, title in [(group.name, group.title), *((c.id, c.title) for c in group.checks)]
        ]
    return [CompletionItem(name, help=title) for name, title in names if name.startswith(begun)]


_levels: Final[Decorator] = add_options(
    click.option(f"--{_LEVELS[0]}", is_flag=True, help="Only read from the node (default)."),
    click.option(f"--{_LEVELS[1]}", is_flag=True, help="Also test NMT, SYNC, PDO and writes."),
    click.option(f"--{_LEVELS[2]}", is_flag=True, help="Also test reset, LSS, store and restore."),
)
_choice: Final[Decorator] = add_options(
    click.option("--node", type=click.IntRange(1, 127), metavar="N", help="Node-ID, 1 to 127."),
    eds_document.node_eds_option(),
    _levels,
    click.option(
        "--stimulus", metavar="CMD", help="Operate inputs by a command, control:PATH or ask."
    ),
    click.option(
        "--allow", multiple=True, metavar="INDEX", help="Allow writes to INDEX, such as 6200h."
    ),
    click.option(
        "--never", multiple=True, metavar="INDEX", help="Never write INDEX, such as 2000h."
    ),
    click.option(
        "--max-load",
        type=_Percent(_LEAST_LOAD, 100),
        default=30,
        metavar="PERCENT",
        help="Limit the bus load of the tester.  [30]",
    ),
    click.option("--yes", is_flag=True, help="Do not ask for confirmation."),
    click.option(
        "--only",
        multiple=True,
        metavar="GROUP|ID",
        shell_complete=_complete_only,
        help="Run only some checks, such as NMT or UE-01,PR-*.",
    ),
    click.option("--list", "lists", is_flag=True, help="List the checks and exit."),
    click.option(
        "--seed",
        type=click.IntRange(0),
        default=0,
        metavar="N",
        help="Seed to shuffle the objects; 0 keeps their order.  [0]",
    ),
)
_reports: Final[Decorator] = add_options(
    click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text."),
    click.option("--junit", type=PATH, metavar="FILE", help="Write a JUnit report."),
    click.option("--html", type=PATH, metavar="FILE", help="Write an HTML page with all frames."),
    click.option("--badge", type=PATH, metavar="FILE", help="Write an SVG badge for a README."),
    click.option(
        "--issue",
        type=PATH,
        metavar="FILE",
        help="Write the failures as a Markdown issue, with scripts.",
    ),
    click.option(
        "--baseline", type=PATH, metavar="FILE", help="Read known failures, which do not count."
    ),
    click.option(
        "--write-baseline",
        type=PATH,
        metavar="FILE",
        help="Write the failures of this run as a baseline.",
    ),
)


@click.command(cls=BusCommand)
@click.argument("source", required=False)
@_choice
@_reports
@bus_options
@click.pass_context
def command(context: click.Context, /, source: str | None, **options: Any) -> None:
    """Test one CANopen node, clause by clause.

    The node is a black box. Only its frames on the bus count.

    SOURCE is a bus, or a rig file in virtual time. Alternatively, -i and -c name interface and
    channel of a bus, as in python-can. Other options of a bus apply in both cases. Without --node,
    the command lists the nodes that send. By default, the node is only read. --communication and
    --intrusive do more, restore what they changed, and ask first (--yes). Objects 6000h to 9FFFh,
    which could move something, are only written with --allow. Use --never to exclude manufacturer
    objects that could move something, such as a set pressure.

    \b
    canmon conform can0 --node 5 --eds drive.eds
    canmon conform can0 --node 5 --eds drive.eds --communication --html report.html
    canmon conform -i udp_multicast -c 239.74.163.2 --node 5
    canmon conform bench.toml --node 5 --intrusive --junit out.xml
    canmon conform can0 --node 5 --communication --yes --baseline known.txt
    canmon conform udp --node 5 --intrusive --stimulus control:/tmp/5.ctl
    canmon conform --list --only NMT,HB

    \b
    --stimulus CMD is called as CMD input 6000:01 01, CMD output 6200:01,
    CMD emergency 5000 01, CMD power off; exit status 77: no such input.
    control:PATH is the control socket of an emulator, ask a person here.

    \b
    Exit status  0 all pass      3 the bus failed, or a report could not be written
                 1 a failure     4 something was inconclusive or blocked
                 2 usage         5 nothing was judged
    """  # noqa: D301 - click wants the backspace
    named = BusOptions.__dataclass_fields__.keys() & options.keys()
    bus = BusOptions(**{name: options.pop(name) for name in named})
    options["level"] = _level(options)
    if options["lists"]:
        others = {one.name or "" for one in context.command.params} - {"only", "eds", "lists"}
        refuse_idle("--list judges nothing", *others)
        _list(options["only"], options["eds"] if isinstance(options["eds"], Path) else None)
        return
    context.exit(conformance.Conformance(source, bus, options).run())


def _level(options: dict[str, Any]) -> str:
    """Return the chosen level. Two levels are refused, because the user may want only to read."""
    given = [level for level in _LEVELS if options.pop(level.replace("-", "_"))]
    if len(given) > 1:
        words = " and ".join(f"--{level}" for level in given)
        raise click.UsageError(f"{words}: which level? give one")
    return given[0] if given else _LEVELS[0]


def _list(only: Sequence[str], eds: Path | None) -> None:
    device = None if eds is None else eds_document.read_device_document(eds, "--eds").device
    lines = list(chosen.listed_checks(chosen.patterns(only), device))
    with until_unread():
        for line in lines:
            click.echo(line)
