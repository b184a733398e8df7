"""Names of signals of a bench, without the objects of dictionaries: these are many; of faults."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.bench.bench import Bench
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


def fault_names(bench: Bench) -> tuple[set[str], set[str]]:
    """Return the names of the faults of all wires, and of those of all devices."""
    described = bench.describe()
    physical = {name for name in described.faults if name in described.inputs}
    return described.faults.keys() - physical, physical
