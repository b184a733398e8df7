"""The verb `send`, which sends frames once or repeatedly."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.eds_document import read_identity
from tickrig.host.canmon.model import transmit
from tickrig.host.canmon.output.listening import Pace, until_interrupted
from tickrig.host.canmon.verbs.decode_options import EdsOptions, eds_option, read_eds_files
from tickrig.host.cli.can_options import BusOptions, bus_and_rest, bus_options, fd_options
from tickrig.host.cli.messages import Refused, SourceFailed, refusing, until_unread
from tickrig.host.cli.options import refuse_idle
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.values import parse_time_with_unit_us
from tickrig.wire.can import CanFrame, FdFrame, LogLine, parse_sent
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.host.canmon.conform import conform_source
    from tickrig.host.canmon.model.decode.eds_folder import EdsFiles
    from tickrig.host.canmon.sources import bus_source
    from tickrig.host.canopen.commissioning import node_bus
else:  # python-can is slow
    conform_source = LazyModule("tickrig.host.canmon.conform.conform_source")
    node_bus = LazyModule("tickrig.host.canopen.commissioning.node_bus")
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")


@click.command()
@click.argument("words", nargs=-1, required=True, metavar="[BUS] FRAME...")
@click.option(
    "--every", metavar="TIME", help="Send the frames every TIME, such as 10ms, until Ctrl-C."
)
@click.option("--count", type=click.IntRange(1), metavar="N", help="Stop after N times.")
@click.option(
    "--counter",
    multiple=True,
    metavar="BYTE:LOW..HIGH",
    help="Write a counter to a byte, such as 0:0..255.",
)
@click.option(
    "--checksum",
    multiple=True,
    metavar="BYTE:KIND",
    help="Write a checksum to a byte, such as 7:crc8 or 7:xor:0..6.",
)
@eds_option
@click.option("-q", "--quiet", is_flag=True, help="Do not print the sent frames.")
@bus_options
@fd_options
def command(words: Sequence[str], eds: EdsOptions, **options: Any) -> None:
    """Send frames on BUS: by bytes such as 123#DEADBEEF, or a PDO by the names of its objects.

    Without a BUS, the frames go to the bus of -c. 123##1AABB is a CAN FD frame, in which the digit
    is 1 for BRS, 2 for ESI, 3 for both. SocketCAN accepts it without an option, other drivers need
    --fd.

    Objects that are not named have the value of the EDS, or else 0. Sent frames are printed as
    candump logs them. Bits of a byte are counted with 0.4+4:0..14. Checksums are xor, sum8, neg8,
    crc8 (SAE J1850), crc8-2f (AUTOSAR) and crc8-07 (SMBus), over all other bytes or over the bytes
    of 7:crc8:1..6.

    \b
    canmon send can0 123#DEADBEEF 00000605#40 705#R
    canmon send can0 5.rpdo1 target_velocity=100 --eds 5=drive.eds
    canmon send can0 5.rpdo1 target_velocity=100 --eds-dir eds
    canmon send can0 080# --every 10ms --count 100
    canmon send can0 100#0000 --every 20ms --counter 0:0..14 --checksum 1:crc8
    """  # noqa: D301 - click wants the backspace
    every, count, quiet = options.pop("every"), options.pop("count"), options.pop("quiet")
    fields = _fields(options.pop("counter"), options.pop("checksum"))
    bus, frames = bus_and_rest(words, options["channel"], "FRAME...")
    if bus is None and "#" not in frames[0] and "pdo" not in frames[0]:
        raise Refused(f"-c {options['channel']} names the bus: leave out {frames[0]}, or -c")
    made = _frames(frames, eds, partial(_read_nodes, bus, BusOptions(**options)))
    if all("#" in frame for frame in frames):
        refuse_idle("frames by their bytes have no names", "eds", "eds_folders")
    period_us = _period_us(every, count)
    cyclic = _cyclic(made, period_us, count or (0 if every else 1), fields)
    with (
        bus_source.transmitters([bus], BusOptions(**options)) as (out,),
        until_interrupted(),
        until_unread(),
    ):
        _run(cyclic, out, quiet)
    missed = sum(one.missed for one in cyclic)
    if missed:
        click.echo(f"{missed} periods passed whole and were left out", err=True)


_ReadNodes = Callable[["EdsFiles", set[int]], None]
"""Function that reads the identity of nodes and chooses their files."""


def _frames(
    words: Sequence[str], eds: EdsOptions, read_nodes: _ReadNodes
) -> list[CanFrame | FdFrame]:
    """Return the frames. Words with `=` belong to the PDO before them."""
    texts: list[str] = []
    for word in words:
        if texts and "#" not in word and "=" in word and "#" not in texts[-1]:
            texts[-1] += f" {word}"
        else:
            texts.append(word)
    files = read_eds_files(eds)
    numbers = (text.partition(".")[0] for text in texts if "#" not in text)
    nodes = {int(text) for text in numbers if text.isascii() and text.isdecimal()}
    if files.folder is not None and nodes - files.keys():
        read_nodes(files, {node for node in nodes - files.keys() if 1 <= node <= 127})
    named = transmit.PdoFrames(files)
    with refusing():
        return [parse_sent(text) if "#" in text else named.frame(text) for text in texts]


def _read_nodes(bus: str | None, options: BusOptions, files: EdsFiles, nodes: set[int]) -> None:
    """Read the identities of nodes, so that their files are found."""
    source = conform_source.open_conform_source(bus, None, options)
    try:
        bus_of_nodes = node_bus.NodeBus(source.link)
        for node in sorted(nodes):
            identity = read_identity(bus_of_nodes, node)
            if identity is None:
                said = f"node {node} does not send vendor and product (1018h)"
                raise Refused(f"{said}; give --eds {node}=FILE")
            files.find(source.name, node, identity)
    except LinkClosed as error:
        raise SourceFailed(str(error)) from None
    finally:
        source.close()


def _fields(counters: Sequence[str], checksums: Sequence[str]) -> transmit.FrameFields:
    with refusing():
        return transmit.FrameFields(
            tuple(map(transmit.parse_counter, counters)),
            tuple(map(transmit.parse_checksum, checksums)),
        )


def _period_us(every: str | None, count: int | None) -> int:
    if every is None:
        if count is not None:
            raise Refused("--count says how often --every sends; give --every TIME")
        return NEVER
    with refusing("--every"):
        period_us = parse_time_with_unit_us(every)
    if not period_us:
        raise Refused("a period of 0 us; 1 us is the least")
    return period_us


def _cyclic(
    frames: Sequence[CanFrame | FdFrame], period_us: int, count: int, fields: transmit.FrameFields
) -> list[transmit.TransmitRow]:
    with refusing():
        return [transmit.TransmitRow("", frame, period_us, fields, 0, count) for frame in frames]


def _run(cyclic: Sequence[transmit.TransmitRow], out: bus_source.Transmitter, quiet: bool) -> None:
    pace = Pace()
    while (due_us := min(one.due_us for one in cyclic)) < NEVER:
        pace.wait_until(due_us)
        for one in cyclic:
            for frame in one.tick(pace.now_us):
                out.send(frame)
                if not quiet:
                    click.echo(str(LogLine(time.time_ns() // 1_000, out.name, frame)))
