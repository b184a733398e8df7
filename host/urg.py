"""A SCIP host that never blocks. It sends a request, and fetches the scans later."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import tau
from typing import Final

from tickrig.host.links.link import DeviceRefused, Link
from tickrig.wire import scip
from tickrig.wire import scip as status
from tickrig.wire.errors import WireError


@dataclass(frozen=True, slots=True)
class UrgScan:
    """Distances that a laser scanner (URG) measured in one turn of its mirror.

    Attributes:
        time_ms: time stamp of the sensor at the start of the turn, in milliseconds. It has 24 bits,
            so it wraps.
        first: measurement step (direction) of the first distance.
        cluster: number of steps that are combined into one distance.
        distances_mm: distances in mm as received. A value below the smallest distance that the
            sensor measures (`specification.nearest_mm`) is an error code, not a distance.
        specification: limits and number of steps of the sensor.
    """

    time_ms: int
    first: int
    cluster: int
    distances_mm: tuple[int, ...]
    specification: scip.Specification

    def angle_rad(self, place: int) -> float:
        """Return the direction in which the sensor measured a distance, in radians.

        The direction is 0 straight ahead, and positive to the left.

        Args:
            place: number of the distance in `distances_mm`, from 0.
        """
        step = self.first + place * self.cluster + (self.cluster - 1) / 2
        return (step - self.specification.front) * tau / self.specification.resolution

    def points(self) -> Iterator[tuple[float, float]]:
        """Yield direction in rad and distance in m for each valid distance."""
        low, high = self.specification.nearest_mm, self.specification.farthest_mm
        for place, distance_mm in enumerate(self.distances_mm):
            if low <= distance_mm <= high:
                yield self.angle_rad(place), distance_mm / 1_000


_SILENCE_US: Final = 500_000
"""Longest time without a valid scan, which is five turns, or longer if scans are skipped."""

_ENDLESS: Final = 0
_LEAVE_ADJUST: Final = "2"


class UrgClient:
    """Client of a laser scanner (URG) that starts continuous measurement and receives the scans.

    The client first sends SCIP2.0, which switches a sensor from SCIP 1.1 to 2.0. It then sends TM2
    and QT to stop a measurement that an earlier host has started. If no valid scan arrives within
    the time of five scans, the client starts again. A garbled scan is skipped.

    Args:
        link: serial line to the sensor.
        cluster: number of measurement steps that are combined into one distance, 1..99.
        interval: number of scans that are skipped after each scan, 0..9.

    Attributes:
        specification: specification that the sensor has sent, or None before it arrives.
        garbled: number of garbled replies and scans.
        restarts: number of times the client has started again.
    """

    def __init__(self, link: Link[bytes], cluster: int = 1, interval: int = 0) -> None:
        self._link, self._cluster, self._interval = link, cluster, interval
        self.specification: scip.Specification | None = None
        self.restarts = self._spoilt = 0
        self._begin()

    @property
    def garbled(self) -> int:
        """Number of garbled replies and scans."""
        return self._spoilt + self._splitter.garbled

    def poll(self) -> list[UrgScan]:
        """Return the scans that have arrived since the last call, without waiting.

        Raises:
            LinkClosed: the connection to the sensor is lost.
            DeviceRefused: the sensor reports a fault, or refuses the requested measurement.
        """
        scans, data = [], self._link.receive(0)
        for reply in self._splitter.push(data):
            try:
                scans += self._take(reply)
            except WireError:
                self._spoilt += 1
        if self._link.now_us - self._received_us > _SILENCE_US * (1 + self._interval):
            self.restarts += 1
            self._spoilt = self.garbled
            self._begin()
        return scans

    def close(self) -> None:
        """Switch the laser off, and release the line."""
        self._link.send(scip.Command("QT").encode())
        self._link.close()

    def _begin(self) -> None:
        self._splitter, self._received_us = scip.ReplySplitter(), self._link.now_us
        commands = (scip.Command("TM", _LEAVE_ADJUST), scip.Command("QT"), scip.Command("PP"))
        switch = scip.SWITCH + b"\n"
        self._link.send(switch + b"".join(command.encode() for command in commands))

    def _take(self, reply: scip.Reply) -> list[UrgScan]:
        command = scip.Command.parse(reply.echo)
        if command.symbol == "PP" and reply.status == status.OK:
            self.specification = scip.Specification.parse(reply.lines)
            self._received_us = self._link.now_us
            self._measure(self.specification)
        if command.symbol != "MD" or reply.status in (status.OK, status.REPEATED):
            return []
        if reply.status != status.DATA:
            raise DeviceRefused(f"{reply.echo!r}: status {reply.status}", reply.status)
        if self.specification is None:
            return []
        time_ms, distances = scip.parse_scan(reply.lines, scip.WIDTHS["D"])
        self._received_us = self._link.now_us
        return [
            UrgScan(time_ms, self.specification.first, self._cluster, distances, self.specification)
        ]

    def _measure(self, specification: scip.Specification) -> None:
        steps = f"{specification.first:04}{specification.last:04}"
        rest = f"{self._cluster:02}{self._interval}{_ENDLESS:02}"
        self._link.send(scip.Command("MD", steps + rest).encode())
