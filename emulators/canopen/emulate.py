"""What `canopen-slave-emu` runs, and the EDS that it writes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import click

from tickrig.device.canopen.sdo.sdo_limits import SdoLimits
from tickrig.emulators.canopen.build import describe_device
from tickrig.emulators.canopen.node.node_spec import NodeSpec, parse_ids, parse_node
from tickrig.emulators.canopen.rig_file import RigFile, read_rig
from tickrig.emulators.canopen.run import CanopenOptions, CanopenRun
from tickrig.emulators.commands.run import mistakes_in
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.text.values import parse_size, parse_time_us
from tickrig.wire.canopen.eds.eds_writer import write_eds as format_eds

BUS_FIELDS: Final = ("interface", "channel", "bitrate", "timing", "bus_kwargs")
DEVICES: Final = ("eds", "dcf", "model", "rtc")
"""Options that name the device of a node, one of them at a time."""

STANDARD_OUTPUT: Final = Path("-")


def emulate(
    node_id: str | None, nodes: tuple[str, ...], rig: Path | None, options: dict[str, Any]
) -> int:
    """Run slaves as the command line says, and return the exit status."""
    given = {f"--{name}": options.pop(name) for name in DEVICES}
    bus = BusOptions(**{name: options.pop(name) for name in BUS_FIELDS})
    file = RigFile(()) if rig is None else read_rig(rig)
    specs = (*_specs(given, node_id), *_more(nodes), *file.nodes)
    sdo = _sdo_limits(options.pop("sdo_timeout"), options.pop("sdo_memory"))
    run = CanopenRun(CanopenOptions(specs=specs, body=file.body, bus=bus, sdo=sdo, **options))
    with mistakes_in(spec.device for spec in specs):
        return run.run()


def write_eds(model: str | None, rtc: str | None, path: Path) -> None:
    """Write the EDS of a model or a component."""
    if not (model or rtc):
        raise Refused("--write-eds belongs to --model or --rtc")
    description = describe_device(model or rtc or "")
    text = format_eds(description.template.description, description.info)
    if path == STANDARD_OUTPUT:
        click.echo(text, nl=False)
        return
    try:
        path.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        refuse_path("EDS", error)


def _sdo_limits(timeout: str, memory: str) -> SdoLimits:
    option = "--sdo-timeout"
    try:
        limits = SdoLimits(parse_time_us(timeout))
        option = "--sdo-memory"
        return replace(limits, memory_bytes=parse_size(memory))
    except ValueError as error:
        raise Refused(f"{option}: {error}") from None


def _specs(given: Mapping[str, Path | str | None], node_id: str | None) -> Iterator[NodeSpec]:
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
