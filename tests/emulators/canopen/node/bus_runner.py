"""A slave on an emulated bus under the checks that are made for a slave alone."""

from __future__ import annotations

from tests.device.canopen.runner import Pace, Runner
from tickrig.device.canopen.slave import TICK_US, CanopenSlave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station


class Unfiltered:
    """A device that does not say what it listens to: it is handed every frame."""

    def __init__(self, device: CanopenSlave) -> None:
        self._device = device
        self.reset, self.tick, self.bus_state = device.reset, device.tick, device.bus_state

    @property
    def tick_us(self) -> int:
        return self._device.tick_us

    @property
    def due_us(self) -> int:
        return self._device.due_us


class BusRunner(Runner):
    """Sends what a tick gets back to back over the bus; what comes is noted as it arrives.

    Args:
        slave: fresh, not yet powered.
        filtered: whether its acceptance filter is in use.
    """

    def __init__(self, slave: CanopenSlave, *, filtered: bool) -> None:
        super().__init__(slave, Pace.BURST)
        wire = CanWire()
        self.master = wire.end()
        self.rig = Rig(Station(slave if filtered else Unfiltered(slave), wire.end()))

    def boot(self) -> None:
        """Switch on and forget the boot-up message, which takes its time on the bus."""
        self.wait(2)
        self._unread.clear()

    def _advance(self, end_us: int) -> None:
        frames = tuple(self._queue)
        self._queue.clear()
        for frame in frames:
            self.note(f"> {frame}")
        self.master.send(self.now_us, frames)
        self.now_us += TICK_US
        self.rig.run_to(self.now_us)
        for at_us, frame in self.master.poll_stamped(self.now_us):
            self.note(f"< {at_us} {frame}")
            self._unread[frame.can_id].append(str(frame))
