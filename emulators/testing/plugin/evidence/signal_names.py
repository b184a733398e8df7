"""Names of signals of a bench, without the objects of dictionaries: these are many; of faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from tickrig.device.physical import SignalType
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.host.text.values import Setting

OBJECT = "0x"


def names_of(part: HasSignals) -> list[str]:
    """Return the names of the inputs and outputs of a device."""
    return [name for name in (*part.inputs.table, *part.outputs) if not name.startswith(OBJECT)]


def signals_of(rig: BenchRig) -> dict[str, Callable[[], Setting]]:
    """Return what reads each signal, by its full name."""
    assembly = rig.state.assembly
    return {
        assembly.full_name(device, name): partial(read_signal, part, name)
        for device, part in assembly.parts.items()
        for name in names_of(part)
    }


def fault_names(bench: Bench) -> tuple[set[str], set[str]]:
    """Return the names of the faults of all wires, and of those of all devices."""
    try:
        return bench._mode.act(_names_on)
    except NotOnThisBench:
        signals: Mapping[str, Any] = bench.describe()
        physical = {one["name"] for one in signals["inputs"] if one["kind"] == "fault"}
        return {fault["name"] for fault in signals["wire_faults"]}, physical


def _names_on(rig: BenchRig) -> tuple[set[str], set[str]]:
    inputs = rig.state.assembly.inputs
    return set(rig.wire.fault_types), set(inputs.names(SignalType.FAULT))
