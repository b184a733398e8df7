"""What is wrong with a bench though no test ordered it."""

from __future__ import annotations

from collections.abc import Container
from functools import partial
from typing import Final

from tickrig.device.physical import SignalType
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import format_time
from tickrig.wire.can_error import ErrorFrame, describe_error_frame
from tickrig.wire.errors import FramingError

ERRORS: Final = "error frames"
LOST: Final = "lost"


class Health:
    """Listens on a bench from its beginning.

    What is on a wire, or lost there, is ordered if a fault of this wire, or of any device, came
    before. A line on which no host spoke may overflow: nobody reads there.

    Args:
        rig: of the bench.
    """

    def __init__(self, rig: BenchRig) -> None:
        self._rig = rig
        mounts = rig.state.mounts
        self._buses = {name for name, on in mounts.items() if isinstance(on, BusMount)}
        self._wires = set(mounts)
        self._faults = frozenset(rig.state.assembly.inputs.names(SignalType.FAULT))
        self._faulty = self._wires if rig.operator.active_faults else set[str]()
        self._spoken = set(self._buses)
        self._errors: dict[str, str] = {}
        rig.journal.listeners.append(self._hear)
        for mount in mounts.values():
            if isinstance(mount, LineMount):
                mount.tap.listeners.append(partial(self._pass, mount.name))

    def complaints(self, allowed: Container[str] = ()) -> tuple[str, ...]:
        """Return what is wrong, each in a line; nothing if all is well.

        Args:
            allowed: what may be nevertheless: `ERRORS`, `LOST`.
        """
        errors = [] if ERRORS in allowed else self._errors.values()
        mounts = {} if LOST in allowed else self._rig.state.mounts
        lost = [
            f"{name}: {on.lost} {'frames' if name in self._buses else 'bytes'} found a buffer full"
            for name, on in mounts.items()
            if on.lost and name in self._spoken - self._faulty
        ]
        recorder = self._rig.state.recorder
        trace = [f"the trace: {recorder.error}"] if recorder and recorder.error else []
        return (*errors, *lost, *trace)

    def _pass(self, wire: str, at_us: int, mark: Mark, data: bytes) -> None:
        """Note that a host spoke."""
        if mark is Mark.TO_DEVICE:
            self._spoken.add(wire)

    def _hear(self, line: WireLine) -> None:
        if line.mark is Mark.PHYSICAL:
            self._done(line)
        elif line.source in self._buses and line.source not in self._errors:
            self._on_bus(line)

    def _done(self, line: WireLine) -> None:
        """Note that a fault came."""
        name = line.data.decode().partition("=")[0]
        names = {name, f"{line.source}/{name}"}
        if line.source in self._wires and names & self._rig.wire.fault_types.keys():
            self._faulty = self._faulty | {line.source}
        elif names & self._faults:
            self._faulty = self._wires

    def _on_bus(self, line: WireLine) -> None:
        """Note the first error frame of a bus on which no fault was."""
        if line.source in self._faulty or line.data[:1] not in b"23" or len(line.data) != 25:
            return
        try:
            frame = ErrorFrame.parse(line.data.decode())
        except FramingError:
            return
        self._errors[line.source] = (
            f"{line.source}: an error frame that no fault ordered, at "
            f"{format_time(line.at_us)} s: {describe_error_frame(frame)}"
        )
