"""A device on a port, and the timetable of the ticks at which several stations have work."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any, Generic, Protocol, TypeGuard

from tickrig.device.core import Device, W
from tickrig.device.twin import Copyable
from tickrig.emulators.rig.kernel import StationFields, TimetableFields, in_kernel
from tickrig.emulators.rig.port import Port, Wire
from tickrig.wire.instant import NEVER, next_tick_us
from tickrig.wire.uart import UartSetting

# Ports of shared wires; the rig asks at run time which ones are.


class WirePort(Protocol[W]):
    """Interface of a `Port` that reports the arrival of traffic, so the rig need not poll it."""

    # Not derived from `Port`: a compiled base class has additional names, which would become
    # members of the protocol.

    @property
    def wire(self) -> Wire:
        """The wire of the port."""
        ...

    def attach(self, device: Device[W], wake: Callable[[int], None], /) -> None:
        """Attach a device, and call `wake` with the arrival time of its traffic."""


def is_wire_port(port: object) -> TypeGuard[WirePort[Any]]:
    """Return whether a port has the members of `WirePort`; `__getattr__` may provide them."""
    return hasattr(port, "wire") and hasattr(port, "attach")


class Station(StationFields, Generic[W]):
    """A device together with its port. A rig consists of stations and calls their devices.

    Attributes:
        at_us: time of the next tick in which the rig calls the device, in microseconds.
    """

    __slots__ = ()

    def __init__(self, device: Device[W], port: Port[W]) -> None:
        if getattr(device, "uart", None) is not None:
            port = _UartPort(device, port)
        self.device, self.port, self.tick_us = device, port, device.tick_us
        self.at_us: int = NEVER
        self._timetable: Timetable | None = None

    def stand_in(self, timetable: Timetable | None) -> None:
        """Let arriving traffic enter the station in a timetable; without one, poll the port."""
        self._timetable = timetable
        if is_wire_port(self.port):
            self.port.attach(self.device, self._wake)

    @in_kernel
    def _wake(self, at_us: int) -> None:
        if at_us < self.at_us and self._timetable is not None:
            self._timetable.enter(self, at_us)

    def wake_us(self, now_us: int) -> int:
        """Return the first tick after `now_us` at which this station has work."""
        return next_tick_us(now_us, min(self.device.due_us, self.port.due_us), self.tick_us)


class _UartPort(Copyable, Generic[W]):
    """The port of a device that may change the setting of its line (`UartDevice`)."""

    def __init__(self, device: Any, port: Any) -> None:
        self._device, self._port = device, port
        self._setting: UartSetting | None = None
        self._follow(0)

    @property
    def due_us(self) -> int:
        """Time at which the next traffic reaches the device."""
        return self._port.due_us  # type: ignore[no-any-return] # a Port

    def poll(self, now_us: int, /) -> W:
        """Return the arrived traffic."""
        return self._port.poll(now_us)  # type: ignore[no-any-return] # a Port

    def send(self, now_us: int, traffic: W, /) -> None:
        """Send the traffic of a tick, then apply the present UART setting of the device."""
        self._port.send(now_us, traffic)
        self._follow(now_us)

    def _follow(self, now_us: int) -> None:
        setting: UartSetting | None = self._device.uart
        if setting is not None and setting != self._setting:
            self._setting = setting
            self._port.use_uart(now_us, setting)


# Timetable of ticks with work.


class Timetable(TimetableFields):
    """The ticks in which devices of a rig have work, in order of time, each with its stations.

    A station is a device at its port. The rig calls a station at the tick `station.at_us`. If the
    timetable has older entries of the station at later ticks, they are ignored.

    Attributes:
        first_us: time of the first tick with work, or `NEVER` if there is none.
        open_us: earliest time for which `enter` can plan a tick, in microseconds.
        in_step: flag that is 1 while a step of the rig is running, otherwise 0. The flag is stored
            in this class for the compiled kernel; an SDO transfer then takes 2 % less time.
    """

    __slots__ = ()

    def __init__(self) -> None:
        self.first_us, self.open_us, self.in_step = NEVER, 1, 0
        self._ticks: list[int] = []  # a heap
        self._stations: dict[int, list[Station[Any]]] = {}

    @in_kernel
    def enter(self, station: Station[Any], at_us: int) -> None:
        """Plan to call a station (a device at its port) in its first tick at or after `at_us`.

        If an earlier tick is already planned for the station, that tick stays planned.
        """
        if at_us >= station.at_us:
            return
        tick_us = station.tick_us
        at_us = -(-max(at_us, self.open_us) // tick_us) * tick_us
        if at_us >= station.at_us:
            return
        station.at_us = at_us
        stations = self._stations.get(at_us)
        if stations is not None:
            stations.append(station)
            return
        self._stations[at_us] = [station]
        heappush(self._ticks, at_us)
        self.first_us = min(self.first_us, at_us)

    @in_kernel
    def take(self, now_us: int) -> list[Station[Any]]:
        """Return the stations that have work by `now_us`."""
        if self.first_us > now_us:
            return []
        taken = []
        while self._ticks and self._ticks[0] <= now_us:
            at_us = heappop(self._ticks)
            for station in self._stations.pop(at_us):
                if station.at_us == at_us:
                    station.at_us = NEVER
                    taken.append(station)
        while self._ticks:  # drop ticks without valid entries
            at_us = self._ticks[0]
            for station in self._stations[at_us]:
                if station.at_us == at_us:
                    self.first_us = at_us
                    return taken
            del self._stations[heappop(self._ticks)]
        self.first_us = NEVER
        return taken
