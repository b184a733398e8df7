"""The command `canopen-slave-emu`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click
from click.shell_completion import CompletionItem

from tickrig.emulators.canopen.build import describe_device
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.canopen.node_spec import NodeSpec, parse_ids, parse_node
from tickrig.emulators.canopen.profiles import AUTO, CHOICES
from tickrig.emulators.canopen.rig_file import RigFile, read_rig
from tickrig.emulators.canopen.rtc import one_line_for
from tickrig.emulators.canopen.run import CanopenOptions, CanopenRun
from tickrig.emulators.run_options import run_options
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.options import PATH
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.wire.canopen.eds_writer import write_eds as format_eds

BUS_FIELDS: Final = ("interface", "channel", "bitrate", "timing", "bus_kwargs")
STANDARD_OUTPUT: Final = Path("-")


def complete_node(
    context: click.Context, option: click.Parameter, word: str
) -> list[CompletionItem]:
    """Complete `5=ep` to `5=epos`, and let the shell add its files."""
    ids, equals, start = word.rpartition("=")
    models = [f"{ids}{equals}{name}" for name in MODELS if name.startswith(start)]
    return [*map(CompletionItem, models), CompletionItem(word, type="file")]


@click.command(cls=BusCommand)
@click.option("--eds", type=PATH, help="EDS that the node is made of.")
@click.option("--dcf", type=PATH, help="DCF that it is made of; it may give the node-ID.")
@click.option(
    "--model",
    type=click.Choice(list(MODELS)),
    metavar="NAME",
    help=f"Device that needs no file: {', '.join(MODELS)}.",
)
@click.option("--rtc", metavar="FILE.py:Class", help="DeviceRTC: the component of a file of yours.")
@click.option("--node-id", metavar="N", help="1..127, or lss for a node that waits for LSS.")
@click.option(
    "--node",
    "nodes",
    multiple=True,
    metavar="N=FILE|MODEL",
    shell_complete=complete_node,
    help="One more node, as 5=a.eds or 5=epos; 1-20=a.eds makes twenty; may be repeated.",
)
@click.option("--rig", type=PATH, help="TOML file with tables [[node]], and [body] if it has one.")
@click.option(
    "--profile",
    type=click.Choice(CHOICES),
    default=AUTO,
    help="CiA profile of nodes of an EDS or DCF; auto takes that of its device type.  [auto]",
)
@click.option(
    "--write-eds",
    type=PATH,
    help="Write the EDS of --model or --rtc to a file (- is standard output), and end.",
)
@bus_options
@click.option("--store", type=PATH, help="File for what is stored by 1010h and LSS.")
@click.option("--trace", type=PATH, help="File to record the bus in, as a candump log.")
@run_options("drop, corrupt, duplicate, delay, babble, short")
@click.pass_context
def main(  # noqa: PLR0913, PLR0917 - options, by keyword
    context: click.Context,
    /,
    eds: Path | None,
    dcf: Path | None,
    model: str | None,
    rtc: str | None,
    node_id: str | None,
    nodes: tuple[str, ...],
    rig: Path | None,
    write_eds: Path | None,
    **options: Any,
) -> None:
    """Emulate CANopen slaves, made of their EDS or DCF or out of the box, on a CAN bus.

    The bus is one of python-can's, named by -i and -c, by its environment
    variables or its configuration files. It runs in real time until Ctrl-C. A
    scenario alone runs in virtual time: as fast as it goes, with the same
    candump log each time, exit status 1 if something expected did not come.
    Together with -i, -c or --control it is played in real time.

    \b
    canopen-slave-emu --model epos --node-id 5 -i socketcan -c vcan0
    canopen-slave-emu --eds motor.eds --node-id 5 -i socketcan -c vcan0
    canopen-slave-emu --node 5=a.eds --node 6=b.eds -i udp_multicast -c ff11::1
    canopen-slave-emu --eds motor.eds --node-id lss --store memory.json -c can0 -i socketcan
    canopen-slave-emu --eds motor.eds --node-id 5 --scenario start.txt > run.log
    canopen-slave-emu --rig examples/rigs/beego.toml -i socketcan -c vcan0
    canopen-slave-emu --rtc my_rtc.py:Gripper --node-id 16 -i socketcan -c vcan0
    canopen-slave-emu --model epos --write-eds epos.eds

    \b
    Completion of options in the shell:
    eval "$(_CANOPEN_SLAVE_EMU_COMPLETE=bash_source canopen-slave-emu)"
    """  # noqa: D301 - click wants the backspace
    if write_eds:
        _write_eds(model, rtc, write_eds)
        return
    bus = BusOptions(**{name: options.pop(name) for name in BUS_FIELDS})
    file = RigFile(()) if rig is None else read_rig(rig)
    given = {"--eds": eds, "--dcf": dcf, "--model": model, "--rtc": rtc}
    specs = (*_specs(given, node_id), *_more(nodes), *file.nodes)
    run = CanopenRun(CanopenOptions(specs=specs, body=file.body, bus=bus, **options))
    with one_line_for(spec.device for spec in specs):
        context.exit(run.run())


def _specs(given: dict[str, Path | str | None], node_id: str | None) -> Iterator[NodeSpec]:
    """Give the nodes of --eds, --dcf, --model or --rtc."""
    named = {option: device for option, device in given.items() if device}
    if len(named) > 1:
        raise Refused(f"{' and '.join(named)} name the same thing: give one of them")
    for device in named.values():
        numbers = parse_ids("--node-id", node_id) if node_id else (None,)
        yield from (NodeSpec(device, number) for number in numbers)
    if node_id and not named:
        raise Refused(
            "--node-id belongs to --eds, --dcf, --model or --rtc; with --node write N=FILE"
        )


def _more(nodes: tuple[str, ...]) -> Iterator[NodeSpec]:
    for text in nodes:
        yield from parse_node(text)


def _write_eds(model: str | None, rtc: str | None, path: Path) -> None:
    """Write the EDS of a model or a component."""
    if not (model or rtc):
        raise Refused("--write-eds belongs to --model or --rtc")
    description = describe_device(model or rtc or "")
    text = format_eds(description.template, description.info)
    if path == STANDARD_OUTPUT:
        click.echo(text, nl=False)
        return
    try:
        path.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        refuse_path("EDS", error)
