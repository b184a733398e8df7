"""A rig: devices on wires, stepped together by one clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, Generic

from tickrig.device.core import NEVER, Device, W
from tickrig.emulators.bridge import Bridge
from tickrig.emulators.clock import Clock, VirtualClock
from tickrig.emulators.port import Port

LATE_US: Final = 1_000
"""A step that begins later than this counts as late."""


class Station(Generic[W]):
    """A device on a port."""

    __slots__ = ("device", "port", "tick_us")

    def __init__(self, device: Device[W], port: Port[W]) -> None:
        self.device, self.port, self.tick_us = device, port, device.tick_us

    def wake_us(self, now_us: int) -> int:
        """Return the first tick after `now_us` at which this station has work."""
        first = now_us - now_us % self.tick_us + self.tick_us
        due = min(self.device.due_us, self.port.due_us)
        if due <= first:
            return first
        return NEVER if due >= NEVER else -(-due // self.tick_us) * self.tick_us


class Rig:
    """Stations that share a clock.

    A step has two phases, as registers on one clock line have: first every
    port is polled and every device computes, then everything is sent. So the
    order in which stations are listed cannot change what they do.

    In virtual time the rig jumps over ticks at which no device is due and
    nothing arrives; `dense=True` visits them all, which must make no
    difference. In real time it wakes at every tick and runs those with work.

    Args:
        stations: the devices, each on its port.
        bridges: joints with the outside world (real time).
        clock: a `VirtualClock` unless given.
        dense: run every tick of every device.

    Attributes:
        now_us: time since the start of the rig.
        late_us: by how much the latest step was late.
        late_steps: how many steps began more than `LATE_US` late.
    """

    def __init__(
        self,
        *stations: Station[Any],
        bridges: Sequence[Bridge] = (),
        clock: Clock | None = None,
        dense: bool = False,
    ) -> None:
        self.now_us = self.late_us = self.late_steps = 0
        self._stations, self._bridges = stations, tuple(bridges)
        self._clock = clock or VirtualClock()
        self._jumps = not dense and isinstance(self._clock, VirtualClock)
        self._dense = dense

    @property
    def next_us(self) -> int:
        """When the next step has something to do."""
        now_us = self.now_us
        wake = [bridge.due_us for bridge in self._bridges]
        if self._jumps:
            wake += [station.wake_us(now_us) for station in self._stations]
        else:
            wake += [now_us - now_us % s.tick_us + s.tick_us for s in self._stations]
        return max(now_us, min(wake, default=NEVER))

    def step(self) -> None:
        """Go to the next time with something to do, and do it; nothing if that never comes."""
        if (next_us := self.next_us) != NEVER:
            self._run(next_us)

    def run_to(self, t_us: int) -> None:
        """Step through all that happens up to and at `t_us`."""
        while (next_us := self.next_us) <= t_us:
            self._run(next_us)
        self._idle_to(t_us)

    def run_for(self, duration_us: int) -> None:
        """Step through `duration_us`."""
        self.run_to(self.now_us + duration_us)

    def run_until(self, done: Callable[[], bool], timeout_us: int) -> bool:
        """Step until `done()`; False if `timeout_us` passed first."""
        deadline_us = self.now_us + timeout_us
        while not done():
            if self.next_us > deadline_us:
                self._idle_to(deadline_us)
                return done()
            self.step()
        return True

    def _idle_to(self, t_us: int) -> None:
        if t_us > self.now_us:
            self._clock.wait_until(t_us)
            self.now_us = t_us

    def _run(self, now_us: int) -> None:
        late_us = self._clock.wait_until(now_us)
        self.now_us = now_us
        self.late_us = max(self.late_us, late_us)
        self.late_steps += late_us > LATE_US
        for bridge in self._bridges:
            bridge.take_in(now_us)
        sent = []
        for station in self._stations:
            if now_us % station.tick_us:
                continue
            received = station.port.poll(now_us)
            if received or self._dense or station.device.due_us <= now_us:
                sent.append((station.port, station.device.tick(now_us, received)))
        for port, traffic in sent:
            port.send(now_us, traffic)
        for bridge in self._bridges:
            bridge.give_out(now_us)
