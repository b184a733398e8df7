"""The journal of a bench as readable text; CAN frames are decoded."""

from __future__ import annotations

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
    from tickrig.host.canmon.model import frames
    from tickrig.host.canmon.model.decode import decoder
else:  # a failure needs them, not each test
    decoder = LazyModule("tickrig.host.canmon.model.decode.decoder")
    frames = LazyModule("tickrig.host.canmon.model.frames")


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
        mounts = mode.act(lambda rig: rig.state.mounts)
    except NotOnThisBench:
        return tuple(wire for wire in mode.wires if isinstance(mode.doors.address(wire), dict))
    return tuple(name for name, mount in mounts.items() if isinstance(mount, BusMount))


def decoded(bench: Bench) -> Iterator[tuple[WireLine, str]]:
    """Yield each line of a bench's journal with its text; the text of a CAN frame is decoded.

    PDOs are decoded by the mapping that the host wrote, even if the journal no longer has the lines
    with the mapping.
    """
    meanings, buses = decoder.Decoder(), buses_of(bench)
    for line in bench._mode.mappings():
        _meaning(meanings, line)
    for line in bench._mode.journal():
        text = escape(line.data)
        if line.source in buses:
            text = f"{text}  {_meaning(meanings, line)}".rstrip()
        yield line, text


def last_lines(bench: Bench, count: int) -> str:
    """Return the last events on a bench as lines of text with time, wire, direction and content.

    Lines that were not complete at the end come last.
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
