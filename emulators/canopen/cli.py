"""The command `canopen-slave-emu`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.emulators.canopen.choices import AUTO, MODEL_FAULTS, MODELS, NODE_FAULTS, PROFILES
from tickrig.emulators.commands.run_options import run_options
from tickrig.host.cli.can_options import BusCommand, bus_options
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import load

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


_RUN: Final = "tickrig.emulators.testing.commands.canopen_run"


def _complete_node(
    context: click.Context, option: click.Parameter, word: str
) -> list[CompletionItem]:
    """Complete `5=ep` to `5=epos`, and let the shell add its files."""
    from click.shell_completion import CompletionItem  # noqa: PLC0415 - slow

    ids, equals, start = word.rpartition("=")
    models = [f"{ids}{equals}{name}" for name in MODELS if name.startswith(start)]
    return [*map(CompletionItem, models), CompletionItem(word, type="file")]


def _device_faults(context: click.Context) -> tuple[str, ...]:
    """Give the faults of the node, those of its model too where --model is given."""
    return (*NODE_FAULTS, *MODEL_FAULTS.get(context.params.get("model") or "", ()))


@click.command(cls=BusCommand)
@click.option("--eds", type=PATH, help="EDS that the node is made of.")
@click.option("--dcf", type=PATH, help="DCF that it is made of; it may give the node-ID.")
@click.option(
    "--model",
    type=click.Choice(MODELS),
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
    shell_complete=_complete_node,
    help="One more node, as 5=a.eds or 5=epos; 1-20=a.eds makes twenty; may be repeated.",
)
@click.option("--rig", type=PATH, help="Rig file: its nodes, and the body that they move.")
@click.option(
    "--bus",
    "bus_file",
    type=PATH,
    help="bus.yml of ros2_canopen or dcfgen: a node for each of it, with motor and switches.",
)
@click.option("--urdf", type=PATH, help="Robot with the joints of --bus, expanded by xacro.")
@click.option(
    "--profile",
    type=click.Choice(PROFILES),
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
@click.option(
    "--sdo-timeout",
    default="5s",
    metavar="TIME",
    help="Silence of a client after which an SDO transfer is aborted.  [5s]",
)
@click.option(
    "--sdo-memory",
    default="64M",
    metavar="SIZE",
    help="What the strings and domains of a node hold together, as 4096, 64k, 16M.  [64M]",
)
@click.option("--trace", type=PATH, help="File to record the bus in, as a candump log.")
@run_options("drop, corrupt, duplicate, delay, babble, short", _device_faults)
@click.pass_context
def main(  # noqa: PLR0913 - options
    context: click.Context,
    /,
    *,
    node_id: str | None,
    nodes: tuple[str, ...],
    rig: Path | None,
    bus_file: Path | None,
    urdf: Path | None,
    write_eds: Path | None,
    **options: Any,
) -> None:
    """Emulate CANopen slaves, made of their EDS, DCF or XDD or out of the box, on a CAN bus.

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
    canopen-slave-emu --bus bus.yml -i socketcan -c vcan0
    canopen-slave-emu --rtc my_rtc.py:Gripper --node-id 16 -i socketcan -c vcan0
    canopen-slave-emu --model epos --write-eds epos.eds

    \b
    Completion of options in the shell:
    eval "$(_CANOPEN_SLAVE_EMU_COMPLETE=bash_source canopen-slave-emu)"
    """  # noqa: D301 - click wants the backspace
    if write_eds:
        load(f"{_RUN}:write_eds")(options["model"], options["rtc"], write_eds)
    else:
        context.exit(load(f"{_RUN}:emulate")(node_id, nodes, rig, (bus_file, urdf), options))
