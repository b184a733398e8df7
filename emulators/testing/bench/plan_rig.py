"""The rig of a bench, with all that a rig file says of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tickrig.emulators.canopen.build import store_keeper
from tickrig.emulators.testing.bench.bench_rig import BenchRig, Parts, RigState
from tickrig.emulators.testing.bench.plan_parts import begin_faults
from tickrig.emulators.testing.rig_file.plan import RigPlan

if TYPE_CHECKING:
    from tickrig.emulators.testing.bench.modes.real.outside import Outside

NAME = "bench"


def rig_of(
    parts: Parts,
    plan: RigPlan,
    outside: Outside | None = None,
    *,
    trace: Path | None = None,
    keeps: bool = True,
) -> BenchRig:
    """Make a rig.

    Args:
        parts: the devices on their wires.
        plan: what else is said of them: faults, and where nodes keep what they store.
        outside: where hosts are; without it time is virtual.
        trace: the file in which the run is recorded.
        keeps: whether the run is kept in memory, if it is not in a file.

    Raises:
        ValueError: an input, signal or fault that cannot be.
        OSError: the file of the trace cannot be opened.
    """
    state = RigState(
        parts,
        bridges=outside.bridges if outside else (),
        clock=outside.clock if outside else None,
        trace=trace,
        keeps=keeps,
    )
    for store in parts.stores:
        state.rig.watchers.append(store_keeper(store))
    rig = BenchRig(NAME, state)
    begin_faults(plan, rig)
    return rig
