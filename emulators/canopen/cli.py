"""The command `canopen-slave-emu`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tickrig.emulators.can_options import BusCommand, BusOptions, bus_options
from tickrig.emulators.canopen.node_spec import NodeSpec, parse_ids, parse_node, read_rig
from tickrig.emulators.canopen.run import CanopenOptions, CanopenRun
from tickrig.emulators.refused import Refused
from tickrig.emulators.run_options import PATH, run_options

BUS_FIELDS = ("interface", "channel", "bitrate", "timing", "bus_kwargs")


@click.command(cls=BusCommand)
@click.option("--eds", type=PATH, help="EDS that the node is made of.")
@click.option("--dcf", type=PATH, help="DCF that it is made of; it may give the node-ID.")
@click.option("--node-id", metavar="N", help="1..127, or lss for a node that waits for LSS.")
@click.option(
    "--node",
    "nodes",
    multiple=True,
    metavar="N=FILE",
    help="One more node, as 5=a.eds; 1-20=a.eds makes twenty; may be repeated.",
)
@click.option("--rig", type=PATH, help="TOML file with a table [[node]] for each node.")
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
    node_id: str | None,
    nodes: tuple[str, ...],
    rig: Path | None,
    **options: Any,
) -> None:
    """Emulate CANopen slaves, made of their EDS or DCF, on a CAN bus.

    The bus is one of python-can's, named by -i and -c, by its environment
    variables or its configuration files. It runs in real time until Ctrl-C. A
    scenario alone runs in virtual time: as fast as it goes, with the same
    candump log each time, exit status 1 if something expected did not come.
    Together with -i, -c or --control it is played in real time.

    \b
    canopen-slave-emu --eds motor.eds --node-id 5 -i socketcan -c vcan0
    canopen-slave-emu --node 5=a.eds --node 6=b.eds -i udp_multicast -c ff11::1
    canopen-slave-emu --eds motor.eds --node-id lss --store memory.json -c can0 -i socketcan
    canopen-slave-emu --eds motor.eds --node-id 5 --scenario start.txt > run.log

    \b
    Completion of options in the shell:
    eval "$(_CANOPEN_SLAVE_EMU_COMPLETE=bash_source canopen-slave-emu)"
    """  # noqa: D301 - click wants the backspace
    bus = BusOptions(**{name: options.pop(name) for name in BUS_FIELDS})
    specs = _specs(eds, dcf, node_id, nodes, rig)
    context.exit(CanopenRun(CanopenOptions(specs=specs, bus=bus, **options)).run())


def _specs(
    eds: Path | None,
    dcf: Path | None,
    node_id: str | None,
    nodes: tuple[str, ...],
    rig: Path | None,
) -> tuple[NodeSpec, ...]:
    """Return all nodes that the options ask for."""
    if eds and dcf:
        raise Refused("--eds and --dcf name the same thing: give one of them")
    file = eds or dcf
    if node_id and not file:
        raise Refused("--node-id belongs to --eds or --dcf; with --node write N=FILE")
    specs: list[NodeSpec] = []
    if file and node_id:
        specs += [NodeSpec(file, number) for number in parse_ids("--node-id", node_id)]
    elif file:
        specs.append(NodeSpec(file, None))
    for text in nodes:
        specs += parse_node(text)
    if rig:
        specs += read_rig(rig)
    return tuple(specs)
