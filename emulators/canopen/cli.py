"""The command `canopen-slave-emu`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.emulators.canopen.choices import AUTO, MODEL_FAULTS, MODELS, NODE_FAULTS, PROFILES
from tickrig.emulators.commands.run_options import run_options
from tickrig.host.cli.can_options import BusCommand, bus_options
from tickrig.host.cli.options import PATH, Choice, refuse_idle
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
    """Return the faults of the node, with the faults of its model if --model is given."""
    return (*NODE_FAULTS, *MODEL_FAULTS.get(context.params.get("model") or "", ()))


@click.command(cls=BusCommand)
@click.option("--eds", type=PATH, help="EDS of the node.")
@click.option("--dcf", type=PATH, help="DCF of the node, which may contain the node-ID.")
@click.option(
    "--model",
    type=Choice(MODELS),
    metavar="NAME",
    help=f"Emulate a built-in model; no file is needed: {', '.join(MODELS)}.",
)
@click.option(
    "--rtc", metavar="FILE.py:Class", help="Emulate a DeviceRTC, a component in your own file."
)
@click.option("--node-id", metavar="N", help="Node-ID 1..127, or lss to get the node-ID by LSS.")
@click.option(
    "--node",
    "nodes",
    multiple=True,
    metavar="N=FILE|MODEL",
    shell_complete=_complete_node,
    help="Add a node, such as 5=a.eds or 5=epos; 1-20=a.eds adds twenty; may be repeated.",
)
@click.option(
    "--rig", type=PATH, help="Emulate the nodes of a rig file, and the body that they move."
)
@click.option(
    "--bus",
    "bus_file",
    type=PATH,
    help="Emulate each node of a bus.yml of ros2_canopen or dcfgen, with motor and switches.",
)
@click.option(
    "--urdf",
    type=PATH,
    help="URDF of the robot with the joints of --bus, already expanded by xacro.",
)
@click.option(
    "--profile",
    type=Choice(PROFILES),
    default=AUTO,
    help="CiA profile of nodes of an EDS or DCF; auto selects by device type. [auto]",
)
@click.option(
    "--write-eds",
    type=PATH,
    help="Write the EDS of --model or --rtc to a file (- is standard output), and exit.",
)
@bus_options
@click.option("--store", type=PATH, help="File for the parameters stored by 1010h and LSS.")
@click.option(
    "--sdo-timeout",
    default="5s",
    metavar="TIME",
    help="Abort an SDO transfer after this silence of the client.  [5s]",
)
@click.option(
    "--sdo-memory",
    default="64M",
    metavar="SIZE",
    help="Memory for all strings and domains of a node, such as 4096, 64k, 16M. [64M]",
)
@click.option("--trace", type=PATH, help="Record the bus in a file, as a candump log.")
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
    """Emulate CANopen slaves on a CAN bus, from EDS, DCF or XDD files or built-in models.

    The bus is a python-can bus, selected by -i and -c, its environment variables or its
    configuration files.

    The emulator runs in real time until Ctrl-C. With --scenario but without -i, -c and --control,
    the scenario runs in virtual time: as fast as possible, with the same candump log each time, and
    with exit status 1 if an expectation was missed. With one of these three options, the scenario
    runs in real time.

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
        runs = ("node_id", "nodes", "rig", "bus_file", "urdf", "store", "trace", "control")
        refuse_idle("--write-eds writes a file and ends", *runs)
        load(f"{_RUN}:write_eds")(options["model"], options["rtc"], write_eds)
    else:
        context.exit(load(f"{_RUN}:emulate")(node_id, nodes, rig, (bus_file, urdf), options))
