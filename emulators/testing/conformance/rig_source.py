"""Rig files as where `canmon conform` finds its node: in virtual time, without a bus outside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.conformance.bench_source import bench_source
from tickrig.emulators.testing.rig_file.plan import DeviceKind, RigPlan
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_file import EdsFile


def open_rig(path: Path, node_id: int | None = None) -> ConformSource:
    """Open a rig file, whatever it says of real time.

    Args:
        path: of the file.
        node_id: of the node whose bus it is; that of the first node if nobody says it.

    Raises:
        OSError: it cannot be read.
        ValueError: something is wrong in it, or no node of it has this node-ID.
        Refused: a device cannot be made.
    """
    plan = read_rig_file(path)
    bench = Bench.of_plan(plan)
    source = bench_source(bench._mode, node_id, str(path))
    files = dict(_eds_files(plan, source.nodes))
    return replace(source, eds={**source.eds, **files}, close=bench.close)


def _eds_files(plan: RigPlan, nodes: dict[int, str]) -> Iterator[tuple[int, EdsFile]]:
    """Yield the files that nodes were made of: what they say is judged too."""
    for node_id, name in nodes.items():
        device = plan.devices[name]
        if device.kind is DeviceKind.EDS:
            yield node_id, open_eds(Path(device.type))
