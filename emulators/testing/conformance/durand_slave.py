"""A node of durand as a slave in virtual time."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from heapq import heappop, heappush
from itertools import count
from threading import Lock
from typing import Any

from durand import Node
from durand.network import NetworkABC
from durand.scheduler import AbstractScheduler, get_scheduler, set_scheduler

from tickrig.emulators.testing.conformance.slave import TICK_US
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

_Call = Callable[[], object]
_Entry = tuple[int, int, _Call]
"""Time, sequence number and callback."""


class DurandSlave:
    """A node of the CANopen library durand, as a slave for the conformance tester.

    The network and the time of the node are virtual.

    durand has one scheduler for the whole process. While the node is called, the scheduler of this
    object takes its place. Afterwards durand's own scheduler is restored.

    Args:
        make: function that makes the node on a network. It is called again at each power-on.

    Attributes:
        node: the node, which boots in its first tick.
    """

    tick_us: int = TICK_US

    def __init__(self, make: Callable[[NetworkABC], Node]) -> None:
        self._make, self._now_us = make, 0
        self.node: Node | None = None
        self.reset()

    @property
    def due_us(self) -> int:
        """Time at which the node boots, or at which its scheduler is due."""
        return 0 if self.node is None or self._actions else self._scheduler.due_us

    def reset(self) -> None:
        """Drop the node; the next tick makes a new node."""
        self.node = None
        self._scheduler, self._network = _Scheduler(), _Network()
        self._actions: list[Callable[[Node], object]] = []

    def act(self, action: Callable[[Node], object]) -> None:
        """Schedule an application call for the start of the next tick, after booting."""
        self._actions.append(action)

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Run due callbacks, then deliver received frames."""
        with self._scheduler.in_use():
            self._scheduler.run(now_us)
            if self.node is None:
                self.node = self._make(self._network)
            for action in self._actions:
                action(self.node)
            self._actions.clear()
            for frame in rx:
                self._network.take(frame)
        return self._network.taken()


class _Network(NetworkABC):  # type: ignore[misc]  # durand has no types
    """A network that collects sent frames."""

    def __init__(self) -> None:
        self._subscriptions: dict[int, Callable[[int, bytes], None]] = {}
        self._sent: list[CanFrame] = []

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        """Subscribe to a COB-ID."""
        self._subscriptions[cob_id] = callback

    def remove_subscription(self, cob_id: int) -> None:
        """Cancel the subscription to a COB-ID. As in durand, raise KeyError if there is none."""
        self._subscriptions.pop(cob_id)

    def send(self, cob_id: int, msg: bytes) -> None:
        """Send a frame."""
        self._sent.append(CanFrame(cob_id & 0x7FF, bytes(msg)))

    def take(self, frame: CanFrame) -> None:
        """Deliver a frame to the subscribers, as durand's listener does."""
        callback = self._subscriptions.get(frame.can_id)
        if frame.remote or frame.extended or callback is None:
            return
        try:
            callback(frame.can_id, frame.data)
        except Exception as error:  # durand's listener logs them and goes on
            logging.getLogger(__name__).info("%s: %r", frame, error)

    def taken(self) -> Frames:
        """Return the collected frames, and clear them."""
        sent, self._sent = tuple(self._sent), []
        return sent


class _Scheduler(AbstractScheduler):  # type: ignore[misc]  # durand has no types
    """Scheduler that calls functions at times of a rig."""

    def __init__(self) -> None:
        self._now_us, self._numbers = 0, count()
        self._entries: list[_Entry] = []
        self._lock = Lock()

    @property
    def due_us(self) -> int:
        """Time at which the next call is due."""
        return self._entries[0][0] if self._entries else NEVER

    @property
    def lock(self) -> Lock:
        """A lock without contention."""
        return self._lock

    def add(
        self,
        delay: float,
        callback: Callable[..., object],
        args: tuple[Any, ...] = (),
        kwargs: Mapping[str, Any] | None = None,
    ) -> _Entry:
        """Call a function after a delay in seconds."""
        at_us = self._now_us + round(delay * 1e6)
        entry = (at_us, next(self._numbers), lambda: callback(*args, **(kwargs or {})))
        heappush(self._entries, entry)
        return entry

    def cancel(self, entry: _Entry) -> None:
        """Cancel a callback that was not called yet."""
        if entry in self._entries:
            self._entries.remove(entry)
            self._entries.sort()

    def run(self, now_us: int) -> None:
        """Run due callbacks, each at its time."""
        while self.due_us <= now_us:
            self._now_us, _, call = heappop(self._entries)
            call()
        self._now_us = now_us

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Act as the scheduler of the process within a block."""
        before = get_scheduler()
        set_scheduler(self)
        try:
            yield
        finally:
            set_scheduler(before)
