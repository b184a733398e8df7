"""The wires of a rig: only those are asked that have something on them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from heapq import heapify, heapreplace
from typing import Final

from tickrig.device.twin import Part
from tickrig.emulators.rig.port import Host, Wire
from tickrig.wire.instant import NEVER

_NOBODY: Final[tuple[Host, ...]] = ()


class Wires(Part):
    """Wires that are moved on together, each by itself for as long as nobody can notice.

    What ends on one wire may let a station send on another, but not before its next tick.
    Up to there each wire goes on alone; in the order of time, frame by frame, where hosts
    wait or several wires have observers.

    A wire without anything on it is left behind: `advance` brings it along.

    Args:
        periods: the control periods, in us, on whose multiples ticks fall.
    """

    def __init__(self, periods: Iterable[int]) -> None:
        self._periods, self._wires = tuple(periods), list[Wire]()
        self._busy: tuple[int, ...] = ()  # places of those that may have something on them

    def __bool__(self) -> bool:
        """Return whether there is any."""
        return bool(self._wires)

    def join(self, wire: Wire) -> None:
        """Take a wire along; one that is there already is no second one."""
        if wire not in self._wires:
            self._wires.append(wire)
            self._hear_of(len(self._wires) - 1, wire)

    def hear_again(self) -> None:
        """Hear of new traffic, after all this was copied."""
        for place, wire in enumerate(self._wires):
            self._hear_of(place, wire)

    def _hear_of(self, place: int, wire: Wire) -> None:
        wire.on_traffic.append(partial(self._begin, place))
        self._begin(place)

    def _begin(self, place: int) -> None:
        """Ask a wire from now on: something is on it."""
        if place not in self._busy:
            self._busy = tuple(sorted((*self._busy, place)))

    @property
    def due_us(self) -> int:
        """When something ends on one of them, `NEVER` if nothing is on its way."""
        return min(self._dues())[0] if self._busy else NEVER

    def _dues(self) -> list[tuple[int, int]]:
        """Return when something ends next on those that have something on them, and where."""
        dues = [(self._wires[place].due_us, place) for place in self._busy]
        if any(due_us == NEVER for due_us, _ in dues):
            self._busy = tuple(place for due_us, place in dues if due_us < NEVER)
        return dues

    def advance(self, now_us: int) -> None:
        """Bring all wires to a time."""
        for wire in self._wires:
            wire.advance(now_us)

    def advance_busy(self, now_us: int) -> None:
        """Bring those to a time that have something on them."""
        for place in self._busy:
            self._wires[place].advance(now_us)

    def advance_until_received(self, until_us: int, hosts: tuple[Host, ...] = _NOBODY) -> bool:
        """Let things end up to a time, but not beyond a tick for which a station was woken.

        Args:
            until_us: the time.
            hosts: who stops it, too, when something has arrived there.

        Returns:
            False if nothing is left that ends by then, and nobody was woken.
        """
        if not self._busy:
            return False
        if len(self._busy) == 1:
            return self._wires[self._busy[0]].advance_until_received(until_us)
        dues = self._dues()
        first_us = min(dues)[0]
        if first_us > until_us:
            return False
        for tick_us in self._periods:  # nobody who hears of it has a tick before
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
        """Let what ends first end first, on whichever wire; stop when a host has something."""
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
