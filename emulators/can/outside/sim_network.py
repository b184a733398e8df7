"""The canopen library as master of a rig in virtual time, without its notifier thread."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterable
from typing import Final

import canopen
import canopen.network
from canopen.sdo.client import BlockUploadStream

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.outside.host import CanHost, Repeat
from tickrig.emulators.rig.retimed import retime, retimed
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import EPOCH_S, SimCondition, SimQueue, SimQueues, SimTime
from tickrig.host.links.can_message import to_message
from tickrig.wire.can import STANDARD_MAX, CanFrame

LIBRARY: Final = "canopen"

Callback = Callable[[int, bytearray, float], None]
Data = bytes | bytearray | Iterable[int] | None


class SimNetwork(canopen.Network):
    """A `canopen.Network` on a rig: whatever waits makes virtual time pass.

    Nodes, SDO clients, PDOs, NMT, EMCY, LSS and p402 are the library's own
    code, run on the rig's clock: time-outs last exactly as long as they say,
    and a run is the same each time. Where an object of the library comes to
    this network its conditions and queues are exchanged, and its methods see
    the rig's `time`; nothing outside of it is touched. A callback is called
    while time passes, whoever makes it pass. Not changed: classes of yours that
    call the real `time`; let time pass by `run_for` or `sleep` instead.

    Args:
        rig: the rig.
        end: an end of its bus that no station has.

    Attributes:
        host: the host's link, for frames by hand.
        clock: the library's `time` on this network.
    """

    def __init__(self, rig: Rig, end: CanEnd) -> None:
        self.host = CanHost(rig, end)
        self.clock = SimTime(self)
        self._names: dict[str, object] = {"time": self.clock, "queue": SimQueues(self)}
        self._names["BlockUploadStream"] = retimed(BlockUploadStream, dict(self._names), LIBRARY)
        self._adopted: dict[int, object] = {}
        self._waits = 0
        super().__init__()
        self._adopt(self.time)
        rig.watchers.append(self._hear)
        rig.hosts.append(end)
        self._rig, self._end = rig, end

    @property
    def time_s(self) -> float:
        """Seconds since 1970 on the library's clock."""
        return EPOCH_S + self.host.now_us / 1e6

    def connect(self, *args: object, **kwargs: object) -> SimNetwork:
        """Return itself: it is connected from the start."""
        return self

    def disconnect(self) -> None:
        """Close the link; the rig stays as it is."""
        super().disconnect()
        if self._hear in self._rig.watchers:
            self._rig.watchers.remove(self._hear)
            self._rig.hosts.remove(self._end)
        self.host.close()

    def run_for(self, duration_us: int) -> None:
        """Let time pass, and deliver what comes meanwhile."""
        self._wait_until(lambda: False, self.host.now_us + duration_us)

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        """Let time pass until `done()`; False if the timeout was first."""
        timeout_us = None if timeout_s is None else round(timeout_s * 1e6)
        return self._wait_until(done, None if timeout_us is None else self.host.now_us + timeout_us)

    def _wait_until(self, done: Callable[[], bool], deadline_us: int | None) -> bool:
        self._waits += 1
        try:
            while not done():
                left_us = None if deadline_us is None else deadline_us - self.host.now_us
                taken = self.host.take(left_us)
                if taken is None:
                    return done()
                self._deliver(*taken)
        finally:
            self._waits -= 1
        return True

    def _hear(self, now_us: int) -> None:
        """Deliver what has come while somebody else made time pass."""
        if not self._waits:
            while (taken := self.host.take(0)) is not None:
                self._deliver(*taken)

    def _deliver(self, at_us: int, frame: CanFrame) -> None:
        message = to_message(frame, EPOCH_S * 1_000_000 + at_us)
        for listener in tuple(self.listeners):
            listener.on_message_received(message)  # type: ignore[no-untyped-call]  # canopen's

    def send_message(self, can_id: int, data: Data, remote: bool = False) -> None:
        """Send a frame; no time passes."""
        self.host.send((_frame(can_id, data, remote=remote),))

    def send_periodic(
        self, can_id: int, data: Data, period: float, remote: bool = False
    ) -> SimPeriodic:
        """Send a frame each `period` seconds while time passes."""
        frame = _frame(can_id, data, remote=remote)
        return SimPeriodic(self.host.repeat((frame,), round(period * 1e6)))

    def subscribe(self, can_id: int, callback: Callback) -> None:
        """Listen to a CAN-ID, and put the listener on the rig's clock."""
        self._adopt(getattr(callback, "__self__", None))
        super().subscribe(can_id, callback)

    def __setitem__(self, node_id: int, node: canopen.RemoteNode | canopen.LocalNode) -> None:
        """Add a node, and put all its parts on the rig's clock."""
        super().__setitem__(node_id, node)
        self._adopt(node)
        for pdos in (node.tpdo, node.rpdo):
            for pdo in (pdos.map or {}).values():
                self._adopt(pdo)

    def _adopt(self, target: object) -> None:
        """Exchange what an object of the library waits on, once."""
        bases = {base.__module__.partition(".")[0] for base in type(target).__mro__}
        if LIBRARY not in bases or id(target) in self._adopted:
            return
        self._adopted[id(target)] = target
        for name, value in tuple(vars(target).items()):
            if type(value) is threading.Condition:
                setattr(target, name, SimCondition(self))
            elif type(value) is queue.Queue:
                setattr(target, name, SimQueue(self))
        retime(target, self._names, LIBRARY)


class SimPeriodic(canopen.network.PeriodicMessageTask):
    """A frame that the library sends periodically."""

    def __init__(self, repeat: Repeat) -> None:
        self._repeat = repeat

    def stop(self) -> None:
        """Send it no more."""
        self._repeat.stop()

    def update(self, data: Data) -> None:
        """Send other data from the next time on."""
        (frame,) = self._repeat.frames
        self._repeat.frames = (frame._replace(data=bytes(data or ())),)


def _frame(can_id: int, data: Data, *, remote: bool) -> CanFrame:
    payload = bytes(data or ())
    extended = can_id > STANDARD_MAX
    if remote:
        return CanFrame(can_id, b"", True, extended, len(payload))
    return CanFrame(can_id, payload, extended=extended).checked()
