"""The journal of a bench as readable text; CAN frames are decoded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from tickrig._lazy import LazyModule
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.mounts import BusMount
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.errors import FramingError

if TYPE_CHECKING:
    from tickrig.emulators.canopen.node import Node
    from tickrig.host.canmon.model import frames
    from tickrig.host.canmon.model.decode import decoder, node_memory
    from tickrig.wire.canopen.eds import eds_device, object_table
else:  # a failure needs them, not each test
    decoder = LazyModule("tickrig.host.canmon.model.decode.decoder")
    eds_device = LazyModule("tickrig.wire.canopen.eds.eds_device")
    frames = LazyModule("tickrig.host.canmon.model.frames")
    node_memory = LazyModule("tickrig.host.canmon.model.decode.node_memory")
    object_table = LazyModule("tickrig.wire.canopen.eds.object_table")


# Names of signals of a bench, without the objects of dictionaries: these are many; of faults.

_OBJECT = "0x"


def names_of(part: HasSignals) -> list[str]:
    """Return the names of the inputs and outputs of a device."""
    return [name for name in (*part.inputs.table, *part.outputs) if not name.startswith(_OBJECT)]


def signals_of(rig: BenchRig) -> dict[str, Callable[[], Setting]]:
    """Return the functions that read the signals, by full name of the signal."""
    assembly = rig.state.assembly
    return {
        assembly.full_name(device, name): partial(read_signal, part, name)
        for device, part in assembly.parts.items()
        for name in names_of(part)
    }


def fault_names(bench: Bench) -> tuple[set[str], set[str]]:
    """Return the names of all wire faults of a bench, and of all faults of its devices."""
    described = bench.describe()
    physical = {name for name in described.faults if name in described.inputs}
    return described.faults.keys() - physical, physical


def buses_of(bench: Bench) -> tuple[str, ...]:
    """Return the names of the CAN buses of a bench."""
    mode = bench._mode
    try:
        return tuple(mode.act(_buses))
    except NotOnThisBench:
        return tuple(wire for wire in mode.wires if isinstance(mode.doors.address(wire), dict))


def _buses(rig: BenchRig) -> dict[str, BusMount]:
    mounts = rig.state.mounts.items()
    return {name: mount for name, mount in mounts if isinstance(mount, BusMount)}


def _objects(bench: Bench) -> dict[int, node_memory.EdsObjects]:
    """Return the objects of the emulated nodes by node-ID, if each node-ID is there once."""
    try:
        buses = bench._mode.act(_buses)
    except NotOnThisBench:
        return {}
    nodes = [node for bus in buses.values() for node in bus.nodes.values()]
    ids = Counter(node.slave.node_id for node in nodes)
    return {node.slave.node_id: _objects_of(node) for node in nodes if ids[node.slave.node_id] == 1}


def _objects_of(node: Node) -> node_memory.EdsObjects:
    known = node.slave.dictionary.description
    device = eds_device.EdsDevice(object_table.DeviceInfo(), known.entries, known.objects)
    return node_memory.eds_objects(device, node.slave.node_id, node.name)


def decoded(bench: Bench) -> Iterator[tuple[WireLine, str]]:
    """Yield each line of a bench's journal with its text; the text of a CAN frame is decoded.

    PDOs are decoded with the default mapping of the emulated node, or with the mapping that the
    host wrote, even if the journal no longer has the lines with this mapping.
    """
    meanings, buses = decoder.Decoder(_objects(bench)), buses_of(bench)
    for line in bench._mode.mappings():
        _meaning(meanings, line)
    for line in bench._mode.journal():
        text = escape(line.data)
        if line.source in buses:
            text = f"{text}  {_meaning(meanings, line)}".rstrip()
        yield line, text


def last_lines(bench: Bench, count: int) -> str:
    """Return the last events on a bench as lines of text with time, wire, direction and content.

    A line or frame on a serial line that has not ended yet comes after all other events.
    """
    described = list(decoded(bench))[-count:]
    begun = [(line, f"{escape(line.data)}  (not ended)") for line in bench._mode.unfinished()]
    return "\n".join(
        f"{format_time(line.at_us)} {line.source} {line.mark} {text}"
        for line, text in [*described, *begun]
    )


def frame_of(line: WireLine) -> CanFrame | ErrorFrame | None:
    """Return the CAN frame of a journal line, or None if the line is an action or about a fault."""
    if line.mark in {Mark.PHYSICAL, Mark.WIRE}:
        return None
    text = line.data.decode()
    with suppress(FramingError):
        return ErrorFrame.parse(text)
    return CanFrame.parse(text)


def _meaning(meanings: decoder.Decoder, line: WireLine) -> str:
    frame = frame_of(line)
    return (
        "" if frame is None else meanings.take(frames.Record(line.at_us, line.source, frame)).text
    )
