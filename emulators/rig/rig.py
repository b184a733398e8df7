"""A rig: devices on wires, stepped together by one clock."""

# Theory of operation.
#
# Time is an int of microseconds that only the rig advances. There are three kinds of events:
#   - an action of the event queue, added by a scenario, a signal, or a host that waits;
#   - an end on a wire: a frame or byte has arrived and wakes the station that receives it;
#   - a tick: at multiples of its period a device polls its port, computes, and sends.
# Events of the same time happen in this order. `run_to`, `run_until` and `step` all keep it, so
# the division of a run into calls makes no difference.
#
# A step of the rig has two phases. First all devices poll and compute, then all send. Data sent in
# a tick are received in a later tick, and the order of the stations makes no difference. On a
# shared wire each station may send at once, because a frame takes time to end. Couplings act after
# both phases; the inputs that they set take effect in the next tick. Watchers are called last and
# see a finished step.
#
# Most ticks have no work, and a rig in virtual time jumps over them. Ticks with work are found so:
#   - A station on a shared wire (`WirePort`) is in the `Timetable` at its next tick with work. It
#     is entered when its port wakes it, and after its own tick for `due_us`. `_enter_due` enters
#     it after a change between steps (an input set, an object written). It has one tick; its
#     entries at later ticks are ignored.
#   - All other stations are checked in each step (`_looked_at`), because serial lines only offer
#     `due_us`.
#   - Wires return the time of their next end (`_Wires`). An idle wire is not queried: it calls
#     `on_traffic` when something may end earlier than the time it returned.
# `_planned_us` is the earliest time of a tick or an action. `_go_on` lets wires run up to just
# before it, but stops when a station was woken, because an earlier tick may have been entered.
#
# Several wires run separately up to the next tick at which any receiver of their traffic could
# act. Only waiting hosts, or observers of two wires, require the wires in the order of time.
#
# A drive may compute its next ticks in one go while it is not observed (`Horizon`). `_foresee`
# returns the limit: not with watchers or couplings, and not beyond the next action. `passed_us`
# has the present time, in case the drive is read before the limit.
#
# With the kernel (`kernel.py`), a rig runs in C from tick to tick under these conditions: all its
# stations are on one bus, in virtual time, without bridges, couplings and `hosts`. This includes a
# host that waits on that bus. `run` is the loop of `_go_on`, `_happen` and `_run` over the same
# fields. It returns False when an action is due or a plug is pulled, and the loop here continues.
#
# In real time (`_in_real_time`) the rig wakes at every tick. Bridges take in data before the tick
# and give out data after it. Late ticks are counted, and no tick is skipped.

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from heapq import heapify, heapreplace
from itertools import compress
from operator import attrgetter, not_
from typing import Any, Final, Protocol, TypeVar, overload

from tickrig.device.horizon import Horizon
from tickrig.device.twin import Copyable, Listeners, Part, restore, state_of, twin
from tickrig.device.twin.snapshot import MachineSnapshot
from tickrig.emulators.rig.clock import Clock, VirtualClock
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.kernel import enter_stations, kernel, run, tick_stations
from tickrig.emulators.rig.port import Host, OutsideBridge, Wire
from tickrig.emulators.rig.sim_waits import HostLimit
from tickrig.emulators.rig.station import Station, Timetable, is_wire_port
from tickrig.wire.instant import NEVER, next_tick_us

# Connections of devices besides their wires.


class Coupling(Protocol):
    """Interface of a mechanical connection of devices, such as a belt between two shafts.

    In each step of the rig, the devices compute first, and then the coupling acts. It reads outputs
    of devices, and may set inputs of devices. The inputs take effect in the next tick. Therefore
    the result does not depend on the order of the devices.
    """

    @property
    def tick_us(self) -> int:
        """Period of the coupling, which acts at multiples of the period."""
        ...

    @property
    def due_us(self) -> int:
        """Time at which the coupling acts even if no device has work; see `Device.due_us`."""
        ...

    def act(self, now_us: int, /) -> None:
        """Read outputs of devices, and set inputs."""


# The wires of a rig: only those with traffic are asked.

_NOBODY: Final[tuple[Host, ...]] = ()
_arrived_us = attrgetter("arrived_us")


class _Wires(Part):
    """Wires that are advanced together, each separately as long as this has no visible effect.

    A transmission that ends on one wire may cause a station to send on another wire, but not before
    the next tick of the station. Until this tick each wire is advanced alone. If hosts wait, or if
    several wires have observers, the wires are advanced in order of time, frame by frame instead.

    A wire without traffic is not advanced until `advance` is called.

    Args:
        periods: control periods in us. Ticks are at multiples of the periods.
    """

    def __init__(self, periods: Iterable[int]) -> None:
        self._periods, self._wires = tuple(periods), list[Wire]()
        self._busy: tuple[int, ...] = ()  # places of those that may have something on them

    def __bool__(self) -> bool:
        """Return whether there is any wire."""
        return bool(self._wires)

    def join(self, wire: Wire) -> None:
        """Add a wire; do nothing if the wire was added before."""
        if wire not in self._wires:
            self._wires.append(wire)
            self._hear_of(len(self._wires) - 1, wire)

    def hear_again(self) -> None:
        """Subscribe to new traffic after a copy."""
        for place, wire in enumerate(self._wires):
            self._hear_of(place, wire)

    def _hear_of(self, place: int, wire: Wire) -> None:
        wire.on_traffic.append(partial(self._begin, place))
        self._begin(place)

    def _begin(self, place: int) -> None:
        """Count a wire as busy from now on, because it has traffic."""
        if place not in self._busy:
            self._busy = tuple(sorted((*self._busy, place)))

    @property
    def only_bus(self) -> Any:
        """The CAN bus of the rig, or None if the rig has other wires or no CAN bus."""
        return getattr(self._wires[0], "_kernel_bus", None) if len(self._wires) == 1 else None

    @property
    def due_us(self) -> int:
        """Time at which the next transmission on any wire of the rig ends, or `NEVER`."""
        return min(self._dues())[0] if self._busy else NEVER

    def _dues(self) -> list[tuple[int, int]]:
        """Return the end of the next transmission, and its wire."""
        dues = [(self._wires[place].due_us, place) for place in self._busy]
        if any(due_us == NEVER for due_us, _ in dues):
            self._busy = tuple(place for due_us, place in dues if due_us < NEVER)
        return dues

    def advance(self, now_us: int) -> None:
        """Advance all wires to a time."""
        for wire in self._wires:
            wire.advance(now_us)

    def advance_busy(self, now_us: int) -> None:
        """Advance the wires with traffic to a time."""
        for place in self._busy:
            self._wires[place].advance(now_us)

    def advance_until_received(self, until_us: int, hosts: tuple[Host, ...] = _NOBODY) -> bool:
        """Advance all wires to a time, but stop early if arriving traffic wakes a device.

        Traffic wakes the device that receives it, so the device has work in its next tick. The
        wires stop before this tick.

        Args:
            until_us: latest time to which the wires advance, in microseconds.
            hosts: hosts for which arriving traffic also stops the advance.

        Returns:
            False if no transmission ends by `until_us` and no device was woken.
        """
        if not self._busy:
            return False
        if len(self._busy) == 1:
            return self._wires[self._busy[0]].advance_until_received(until_us)
        dues = self._dues()
        first_us = min(dues)[0]
        if first_us > until_us:
            return False
        for tick_us in self._periods:  # no receiver has a tick before
            until_us = min(until_us, -(-first_us // tick_us) * tick_us)
        if hosts or sum(bool(self._wires[place].observers) for _, place in dues) > 1:
            self._advance_in_order(dues, until_us, hosts)
        else:
            for due_us, place in dues:
                if due_us <= until_us:
                    self._wires[place].advance(until_us)
        return True

    def _advance_in_order(
        self, heap: list[tuple[int, int]], until_us: int, hosts: tuple[Host, ...]
    ) -> None:
        """Advance all wires in order of time; stop when a host has received traffic."""
        heap.append((NEVER, len(self._wires)))
        heapify(heap)
        while heap[0][0] <= until_us:
            place = heap[0][1]
            wire = self._wires[place]
            next_us, next_place = min(heap[1:3])
            alone_us = next_us - (next_place < place)  # the first of those that end together
            received = wire.advance_until_received(min(until_us, alone_us))
            if received and any(host.arrived_us < NEVER for host in hosts):
                return
            heapreplace(heap, (wire.due_us, place))


_LATE_US: Final = 1_000
"""Delay from which a step counts as late."""

LATE_KEPT: Final = 1_000
"""Number of late steps whose times are kept."""


_T = TypeVar("_T")
_U = TypeVar("_U")


class Rig(Copyable):
    """Stations that share a clock.

    A step has two phases, like registers on one clock line. First every port is polled and every
    device computes, then all data are sent. So the order of the stations has no effect.

    In virtual time the rig jumps over ticks at which no device is due and nothing arrives.
    `dense=True` runs all ticks, with the same result. In real time the rig wakes at every tick and
    runs the ticks with work. Stations on a shared wire are in a timetable and take no time until
    they have work. All other stations are checked in every step.

    Actions of the event_queue run whenever the time is advanced. An action runs after all events
    with an earlier time, and before the tick at its own time.

    `fork` copies a running rig with its devices, wires and faults.

    Args:
        stations: the devices, each on its port.
        bridges: connections with the outside world (real time).
        couplings: connections of the devices in addition to their wires, in the order in which they
            act.
        clock: clock of the rig, or None to use a `VirtualClock`.
        dense: whether to run every tick of every device.
        event_queue: actions between ticks, or None to use a new queue.

    Attributes:
        event_queue: actions between ticks.
        stations: the devices, each on its port.
        acting_us: time of the running action of the event_queue, or None if no action runs.
        now_us: time since the start of the rig.
        worst_late_us: largest delay of a step.
        late_ticks: number of steps that started more than `_LATE_US` late.
        host_limit: limit on the waits of hosts. By default there is no limit.
        hosts: ends at which each arrival is a separate step. A watcher handles the arrival.
        watchers: functions that are called with the time after each step, in the order of
            registration.
    """

    def __init__(
        self,
        *stations: Station[Any],
        bridges: Sequence[OutsideBridge] = (),
        couplings: Sequence[Coupling] = (),
        clock: Clock | None = None,
        dense: bool = False,
        event_queue: EventQueue | None = None,
    ) -> None:
        self.now_us = self.worst_late_us = self.late_ticks = 0
        self._late: deque[tuple[int, int]] = deque(maxlen=LATE_KEPT)
        self.event_queue: EventQueue = event_queue or EventQueue()
        self.acting_us: int | None = None
        self.host_limit = HostLimit()
        self.hosts: Listeners[Host] = Listeners()
        self.watchers: Listeners[Callable[[int], None]] = Listeners()
        self._bridges, self._couplings, self._dense = tuple(bridges), tuple(couplings), dense
        self._clock = clock or VirtualClock()
        self._in_real_time = not isinstance(self._clock, VirtualClock)
        self._jumps = not (dense or self._in_real_time)
        periods = {station.tick_us for station in stations}
        self._periods = tuple(sorted(periods | {coupling.tick_us for coupling in couplings}))
        self._timetable, self._wires = Timetable(), _Wires(self._periods)
        self._horizon, self._until_us = Horizon(), 0
        attached = [self._attach(station) and not dense for station in stations]
        self.stations, self._woken = stations, tuple(compress(stations, attached))
        self._looked_at = tuple(compress(stations, map(not_, attached)))
        self._bus: Any = None  # the only one: two layers less than `_wires`
        self._is_plain = False  # there are only stations in the timetable
        self._short: tuple[object, ...] = ()  # what the kernel runs from tick to tick, if it can
        self._look_for_bus()

    def _look_for_bus(self) -> None:
        """Run the rig in the kernel if all stations are on one bus, in virtual time."""
        others = self._bridges or self._couplings or self._looked_at
        virtual = self._jumps and type(self._clock) is VirtualClock
        self._bus, self._is_plain = self._wires.only_bus, self._jumps and not others
        bus = self._bus if kernel and virtual and not others else None
        lists = self.watchers, self.hosts, self._woken
        parts = (self._timetable, bus, self.event_queue, self._horizon, *lists)
        self._short = () if bus is None else parts

    def _attach(self, station: Station[Any]) -> bool:
        """Subscribe to the wake-ups of a station's port, if the port is a `WirePort`."""
        port, device = station.port, station.device
        if not is_wire_port(port):
            return False
        station.stand_in(None if self._dense else self._timetable)
        self._wires.join(port.wire)
        if hasattr(device, "horizon"):
            device.horizon = None if self._dense else self._horizon
        return True

    def __getstate__(self) -> object:
        """Return the initial state of a twin, which has no hosts and runs in virtual time."""
        begun = {"_bridges": (), "_short": (), "_clock": VirtualClock(), "_jumps": not self._dense}
        now = {"_in_real_time": False, "acting_us": None}
        return state_of(self, {**begun, **now})

    def __setstate__(self, state: object) -> None:
        """Restore the state of the copied rig, whose ports have no devices yet."""
        restore(self, state)
        self._timetable.in_step = 0
        self._wires.hear_again()
        for station in self.stations:
            self._attach(station)
        self._look_for_bus()

    @overload
    def fork(self) -> Rig: ...

    @overload
    def fork(self, part: _T, /) -> tuple[Rig, _T]: ...

    @overload
    def fork(self, part: _T, other: _U, /) -> tuple[Rig, _T, _U]: ...

    @overload
    def fork(self, *parts: Any) -> tuple[Any, ...]: ...

    def fork(self, *parts: Any) -> Any:
        """Return a twin of the rig: an independent copy that continues from here.

        With the same input the twin behaves the same to the byte. The twin has the devices, wires,
        faults, couplings and events of this rig. It runs in virtual time and has no connection to
        the outside: no bridge, recorder or observer.

        Args:
            parts: objects of the rig whose copies are returned too, such as the host's end of a
                line.

        Returns:
            The twin, or with `parts` a tuple of the twin and the copied parts.

        Raises:
            TypeError: an object of the rig cannot be copied, such as a pty port. The message names
                the object and the reason.

        >>> from tickrig.device.rrc.machine import Rrc
        >>> from tickrig.emulators.serial.serial_line import SerialLine
        >>> line = SerialLine()
        >>> rig = Rig(Station(Rrc(), line.a))
        >>> twin, end = rig.fork(line.b)
        >>> twin.run_for(100_000)
        >>> end.poll(twin.now_us).strip(), rig.now_us
        (b'EV:Initialized', 0)
        """
        return twin((self, *parts)) if parts else twin(self)

    def snapshot(self, *parts: object) -> MachineSnapshot:
        """Return a snapshot that can restore the present state of the rig any number of times.

        The snapshot restores this rig itself, so references to the ends of its wires stay valid.
        Making a snapshot is about 20 times as fast as making a copy by `fork`.

        Args:
            parts: further objects that are restored with the rig, such as a host.

        Raises:
            TypeError: an object of the rig cannot be restored, such as a pty port.

        >>> from tickrig.device.rrc.machine import Rrc
        >>> from tickrig.emulators.serial.serial_line import SerialLine
        >>> line = SerialLine()
        >>> rig = Rig(Station(Rrc(), line.a))
        >>> snapshot = rig.snapshot(line)
        >>> for run in (1, 2):
        ...     snapshot.restore()
        ...     rig.run_for(100_000)
        ...     print(line.b.poll(rig.now_us).strip())
        b'EV:Initialized'
        b'EV:Initialized'
        """
        return MachineSnapshot(self, *parts)

    @property
    def in_step(self) -> bool:
        """Whether a step is running; callbacks in it cannot wait."""
        return self._timetable.in_step != 0

    def move_on(self, wire: Wire) -> None:
        """Let the rig advance a wire together with its own time.

        The rig already advances each wire on which it has a device, so such a wire needs no call.

        Args:
            wire: wire to advance.
        """
        self._wires.join(wire)
        self._look_for_bus()

    @property
    def next_us(self) -> int:
        """Time of the rig's next event: an action, a tick with work or an end of a transmission.

        In real time a transmission that ends between two ticks becomes visible at the next tick.
        """
        self._enter_due()
        planned_us = self._planned_us
        return planned_us if self._in_real_time else min(planned_us, self._wires.due_us)

    def step(self) -> None:
        """Advance to the next event and run it; do nothing if there is none."""
        self._foresee(0)
        if (next_us := self.next_us) != NEVER:
            self._happen(next_us)
            self._wires.advance(self.now_us)

    def run_to(self, t_us: int, host: Host | None = None, unseen_us: int = 0) -> None:
        """Run the rig up to a time, inclusive, or until traffic has arrived at a host.

        Args:
            t_us: end of the run, in microseconds since the start of the rig.
            host: host whose traffic ends the run early, or None to run to the end.
            unseen_us: duration after `t_us` in microseconds. The caller expects that it will not
                read devices or set inputs between ticks in this time. The run is then faster. If
                the caller reads or sets something all the same, the result is still right.
        """
        self._until_us = t_us + unseen_us if host is None else 0
        if self._short and run(self, self._short, t_us, self._until_us, host):
            return
        self._enter_due()
        if host is None:
            self._foresee(self._until_us)
        else:
            self._horizon.until_us = 0
        while True:
            if (next_us := self._go_on(t_us, host)) > t_us:
                self._pass_to(t_us)
                return
            arrived = host is not None and host.arrived_us <= next_us
            if arrived and self._jumps and not (self.watchers or self._couplings):
                self._pass_to(next_us)  # no device has work, and nobody looks
                return
            self._happen(next_us)
            if host is not None and host.arrived_us <= next_us:
                self._wires.advance(self.now_us)
                return
            if self._short and run(self, self._short, t_us, self._until_us, host):
                return

    def run_for(self, duration_us: int) -> None:
        """Run for a duration.

        Args:
            duration_us: duration in microseconds.
        """
        self.run_to(self.now_us + duration_us)

    def run_until(self, done: Callable[[], bool], timeout_us: int) -> bool:
        """Run the rig until a condition is true, or until a time-out.

        Args:
            done: function without side effects that returns whether the condition is true.
            timeout_us: longest duration of the run, in microseconds.

        Returns:
            True if the condition is true, or False after the time-out.
        """
        deadline_us = self.now_us + timeout_us
        self._enter_due()
        self._foresee(0)
        while not done():
            next_us = min(self._planned_us, self._wires.due_us)
            if next_us > deadline_us or next_us == NEVER:
                if deadline_us < NEVER:
                    self._pass_to(deadline_us)
                return done()
            self._happen(next_us)
            self._wires.advance(self.now_us)
        return True

    def _foresee(self, until_us: int) -> None:
        """Set the time until which devices are not read, unless something happens by `until_us`."""
        self._until_us, seen = until_us, self.watchers or self._couplings
        self._horizon.until_us = 0 if seen else min(until_us, self.event_queue.due_us - 1)

    def _enter_due(self) -> None:
        """Enter stations that became due between steps, for example because an input was set."""
        if kernel and enter_stations(self._timetable, self._woken):
            return
        for station in self._woken:
            if (due_us := station.device.due_us) < station.at_us:
                self._timetable.enter(station, due_us)

    @property
    def _planned_us(self) -> int:
        """The time of the next action, or of the next known tick with work."""
        now_us, next_us = self.now_us, min(self._timetable.first_us, self.event_queue.due_us)
        for bridge in self._bridges:
            next_us = min(next_us, bridge.due_us)
        if self._jumps:
            for station in self._looked_at:
                due_us = min(station.device.due_us, station.port.due_us)
                if due_us < next_us:
                    next_us = min(next_us, next_tick_us(now_us, due_us, station.tick_us))
            for coupling in self._couplings:
                if (due_us := coupling.due_us) < next_us:
                    next_us = min(next_us, next_tick_us(now_us, due_us, coupling.tick_us))
        else:
            for tick_us in self._periods:
                next_us = min(next_us, now_us - now_us % tick_us + tick_us)
        return max(now_us, next_us)

    def _go_on(self, until_us: int, host: Host | None) -> int:
        """Advance the wires to the next tick with work or arrival at a host; return the time."""
        hosts, bus = (*self.hosts,) if host is None else (*self.hosts, host), self._bus
        plain, timetable, queue = self._is_plain, self._timetable, self.event_queue
        while True:
            if plain:
                next_us = max(self.now_us, min(timetable.first_us, queue.due_us))
            else:
                next_us = self._planned_us
            if hosts:
                arrived_us: int = min(map(_arrived_us, hosts))
                if arrived_us < next_us:
                    return max(self.now_us, arrived_us)
            limit_us = next_us - 1 if next_us <= until_us else until_us
            if bus is not None and bus.whole:
                received = bus.advance_until_received(limit_us)
            else:
                received = self._wires.advance_until_received(limit_us, hosts)
            if not received:
                return next_us

    def _happen(self, next_us: int) -> None:
        """Run the next events: all actions of the time, or else its tick."""
        timetable = self._timetable
        outer, timetable.in_step = timetable.in_step, 1
        try:
            if self.event_queue.due_us <= next_us:
                self._act(next_us)
            else:
                self._run(next_us)
        finally:
            timetable.in_step = outer

    def _act(self, now_us: int) -> None:
        """Run the actions due at `now_us`, before the tick of that time."""
        self._pass_to(max(self.now_us, now_us - 1))
        self.acting_us = now_us
        try:
            self.event_queue.run(now_us)
            self._watch(now_us)
        finally:
            self.acting_us = None
        self._enter_due()
        self._foresee(self._until_us)

    def _pass_to(self, t_us: int) -> None:
        """Advance through a time without ticks with work."""
        bus = self._bus
        (self._wires if bus is None or not bus.whole else bus).advance(t_us)
        if t_us > self.now_us:
            if self._in_real_time:
                self._clock.wait_until(t_us)
            self.now_us = self._horizon.passed_us = t_us
        self._timetable.open_us = self.now_us + 1

    def _run(self, now_us: int) -> None:
        late_us = self._clock.wait_until(now_us) if self._in_real_time else 0
        self.now_us = self._timetable.open_us = now_us
        if late_us > 0:
            self._note_late(late_us)
        for bridge in self._bridges:
            bridge.take_in(now_us)
        bus = self._bus
        if bus is not None and bus.whole:
            bus.advance(now_us)
        else:
            self._wires.advance_busy(now_us)
        self._tick(now_us)
        self._horizon.passed_us = now_us
        if self._couplings:
            self._couple(now_us)
        for bridge in self._bridges:
            bridge.give_out(now_us)
        if self.watchers:
            self._wires.advance(now_us)
            self._watch(now_us)
            self._enter_due()

    def _watch(self, now_us: int) -> None:
        for watch in tuple(self.watchers):
            watch(now_us)

    def late_since(self, t_us: int) -> int:
        """Return the largest delay of the steps since `t_us`.

        In a run in real time, a step can be delayed. Delays up to `_LATE_US` are ignored.

        Args:
            t_us: time of the rig in microseconds. Only the last `LATE_KEPT` late steps are stored.
                If there were more since `t_us`, the result is the largest delay of the whole run.
        """
        if len(self._late) == LATE_KEPT and self._late[0][0] > t_us:
            return self.worst_late_us
        return max((late_us for at_us, late_us in self._late if at_us >= t_us), default=0)

    def _note_late(self, late_us: int) -> None:
        self.worst_late_us = max(self.worst_late_us, late_us)
        if late_us > _LATE_US:
            self.late_ticks += 1
            self._late.append((self.now_us, late_us))

    def _tick(self, now_us: int) -> None:
        """Run all devices with work: first compute all, then send all data."""
        sent = []
        for station in self._looked_at:
            if now_us % station.tick_us:
                continue
            received = station.port.poll(now_us)
            if received or self._dense or station.device.due_us <= now_us:
                sent.append((station.port, station.device.tick(now_us, received)))
        timetable = self._timetable
        if not (kernel and tick_stations(timetable, now_us)):
            woken, enter = timetable.take(now_us), timetable.enter
            timetable.open_us = now_us + 1
            # What they send nobody has in this tick: one look at each is enough.
            for station in woken:
                device, port = station.device, station.port
                received = port.poll(now_us)
                if (received or device.due_us <= now_us) and (out := device.tick(now_us, received)):
                    port.send(now_us, out)
                if (due_us := device.due_us) < NEVER:
                    enter(station, due_us)
        for port, traffic in sent:
            port.send(now_us, traffic)

    def _couple(self, now_us: int) -> None:
        """Run the couplings, and enter devices whose inputs they set."""
        acting = [coupling for coupling in self._couplings if now_us % coupling.tick_us == 0]
        for coupling in acting:
            coupling.act(now_us)
        if acting:
            self._enter_due()
