"""A LocalNode of the canopen library as a slave in virtual time."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import Final

import canopen
import canopen.network

from tickrig.emulators.testing.conformance.slave import TICK_US
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

_INITIALISING: Final = 0
_Data = bytes | bytearray | Iterable[int] | None


class LocalNodeSlave:
    """A `canopen.LocalNode` as a slave for the conformance tester, with virtual network and timers.

    The node boots as in the library's documentation (`nmt.send_command(0)`, then Pre-operational).
    This class does no other work of an application. For example, it does not restore values at a
    reset, and sends no TPDOs.

    Args:
        make: function that makes the node with its dictionary. It is called again at each power-on.

    Attributes:
        node: the node.
    """

    tick_us: int = TICK_US

    def __init__(self, make: Callable[[], canopen.LocalNode]) -> None:
        self._make, self.now_us = make, 0
        self.reset()

    @property
    def due_us(self) -> int:
        """Time at which the node boots, or at which its next periodic frame is due."""
        if not self._booted or self._network.has_sent:
            return 0
        return min((task.due_us for task in self._network.tasks), default=NEVER)

    def reset(self) -> None:
        """Make a new node."""
        self._booted = False
        self._network = _Network(self)
        self.node = self._make()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Deliver received frames, then send the frames that are due."""
        self.now_us = now_us
        if not self._booted:
            self._boot()
        for frame in rx:
            self._network.take(frame)
        return self._network.taken(now_us)

    def _boot(self) -> None:
        self._booted = True
        self._network.add_node(self.node)
        self.node.nmt.send_command(_INITIALISING)
        self.node.nmt.state = "PRE-OPERATIONAL"


class _Network(canopen.Network):
    """A network that collects sent frames; periodic frames are sent in the slave's time."""

    def __init__(self, slave: LocalNodeSlave) -> None:
        super().__init__()
        self._slave, self._sent = slave, list[CanFrame]()
        self.tasks: list[_Periodic] = []

    @property
    def has_sent(self) -> bool:
        """Whether there are frames to send."""
        return bool(self._sent)

    def take(self, frame: CanFrame) -> None:
        """Deliver a frame to the subscribers, as the library's listener does."""
        if frame.remote or frame.extended:
            return
        try:
            self.notify(frame.can_id, bytearray(frame.data), self._slave.now_us / 1e6)
        except Exception as error:  # the library's listener logs them and goes on
            logging.getLogger(__name__).info("%s: %s", frame, error)

    def taken(self, now_us: int) -> Frames:
        """Return the frames due by now, and clear them."""
        for task in self.tasks:
            while task.due_us <= now_us:
                task.due_us += task.period_us
                self._sent.append(CanFrame(task.can_id, task.data))
        sent, self._sent = tuple(self._sent), []
        return sent

    def send_message(self, can_id: int, data: _Data, remote: bool = False) -> None:
        """Send a frame."""
        self._sent.append(CanFrame(can_id, bytes(data or b""), remote))

    def send_periodic(
        self, can_id: int, data: _Data, period: float, remote: bool = False
    ) -> _Periodic:
        """Send a frame now, and again each `period` seconds."""
        task = _Periodic(self.tasks, can_id, data, round(period * 1e6), self._slave.now_us)
        self.tasks.append(task)
        return task


class _Periodic(canopen.network.PeriodicMessageTask):
    """A periodic frame."""

    def __init__(
        self, tasks: list[_Periodic], can_id: int, data: _Data, period_us: int, due_us: int
    ) -> None:
        self._tasks, self.can_id, self.data = tasks, can_id, bytes(data or b"")
        self.period_us, self.due_us = max(TICK_US, period_us), due_us

    def stop(self) -> None:
        """Stop sending the frame."""
        if self in self._tasks:
            self._tasks.remove(self)

    def update(self, data: _Data) -> None:
        """Send other data from the next frame on."""
        self.data = bytes(data or b"")
