"""Signals of devices, without the objects of dictionaries: these are many, and on the wire."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.bench.bench_rig import BenchRig
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
