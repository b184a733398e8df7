"""Which stations of a rig have work at which tick."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any

from tickrig.device.twin import Part
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.rig.station import Station


class Timetable(Part):
    """Ticks with work, soonest first, each with its stations.

    A station stands at one tick, `station.at_us`. Where it stood before it was
    entered for an earlier tick it is simply passed over.

    Attributes:
        first_us: the soonest tick with work, `NEVER` if there is none.
        open_us: no tick is entered before this.
    """

    __slots__ = ("_stations", "_ticks", "first_us", "open_us")

    def __init__(self) -> None:
        self.first_us, self.open_us = NEVER, 1
        self._ticks: list[int] = []  # a heap
        self._stations: dict[int, list[Station[Any]]] = {}

    def enter(self, station: Station[Any], at_us: int) -> None:
        """Let a station have work at the first tick from `at_us` on, unless it has some before."""
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

    def take(self, now_us: int) -> list[Station[Any]]:
        """Take the stations that have work by `now_us`."""
        if self.first_us > now_us:
            return []
        taken = []
        while self._ticks and self._ticks[0] <= now_us:
            at_us = heappop(self._ticks)
            for station in self._stations.pop(at_us):
                if station.at_us == at_us:
                    station.at_us = NEVER
                    taken.append(station)
        self._pass_over()
        return taken

    def _pass_over(self) -> None:
        """Drop ticks whose stations all have gone elsewhere."""
        while self._ticks:
            at_us = self._ticks[0]
            if any(station.at_us == at_us for station in self._stations[at_us]):
                self.first_us = at_us
                return
            del self._stations[heappop(self._ticks)]
        self.first_us = NEVER
