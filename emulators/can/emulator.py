"""Emulated devices on a CAN bus, with their operator."""

from __future__ import annotations

from collections.abc import Sequence

from tickrig.emulators.bench.operator import WireFaults
from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.can.bus_device import Accepted
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.outside.bridge import CanBridge, CountingPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.record.recorder import CandumpFile
from tickrig.emulators.rig.clock import Clock
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.rig import Coupling, Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame, Frames


class CanEmulator(RunningEmulator):
    """Devices, their bus, their operator, and a rig that runs them.

    One more end of the bus belongs to the caller. It sends to all devices and to the bus outside,
    and receives all frames. The caller is never alone on the bus: there is always the bus outside,
    or an end that only acknowledges frames.

    Args:
        name: name of the devices.
        physical: the physical side of all devices.
        stations: the devices, each on its end of the bus.
        wire: the bus.
        couplings: connections of the devices besides the bus.
        outside: outside bus of the host, if the host is outside the rig.
        clock: clock of the rig, or None to use a `VirtualClock`.
        trace: the recording, which is closed at the end.
        link: name of the outside bus, as text.
        faults: object on which faults are armed, or None to use the bus.
    """

    def __init__(  # noqa: PLR0913 - options, by keyword
        self,
        name: str,
        physical: HasSignals,
        stations: Sequence[Station[Frames]],
        wire: CanWire,
        *,
        couplings: Sequence[Coupling] = (),
        outside: CountingPort | None = None,
        clock: Clock | None = None,
        trace: CandumpFile | None = None,
        link: str = "",
        faults: WireFaults | None = None,
    ) -> None:
        super().__init__(name, physical, faults or wire.faults, link, trace)
        self._wire, self._outside = wire, outside
        self._ends = [station.port for station in stations]
        self._host = self._open_end()
        beyond = self._open_end(None if outside else frozenset())
        bridges = [CanBridge(beyond, outside)] if outside else []
        self.rig = Rig(
            *stations,
            bridges=bridges,
            couplings=couplings,
            clock=clock,
            event_queue=self.event_queue,
        )

    def _open_end(self, accepts: Accepted = None) -> CanEnd:
        """Connect an end that recovers from bus-off at once."""
        end = self._wire.end(accepts)
        end.auto_recovery = True
        self._ends.append(end)
        return end

    def _listen(self, now_us: int) -> None:
        for at_us, frame in self._host.poll_stamped(now_us):
            self._hear(at_us, Mark.FROM_DEVICE, frame)

    def send(self, now_us: int, data: bytes) -> None:
        """Send a frame in candump's notation on the bus, as a host does."""
        frame = CanFrame.parse(data.decode("ascii"))
        self._hear(now_us, Mark.TO_DEVICE, frame)
        self._host.send(now_us, (frame,))

    def _hear(self, at_us: int, mark: Mark, frame: CanFrame) -> None:
        self.log.hear(at_us, mark, f"{frame}\n".encode())

    @property
    def lost(self) -> dict[str, int]:
        """Number of frames that were lost because a queue was full.

        Each node on the emulated bus has a queue. The port to a real bus has one, too.
        """
        ends = sum(end.lost for end in self._ends if isinstance(end, CanEnd))
        return {"lost_frames": ends + (self._outside.lost if self._outside else 0)}
