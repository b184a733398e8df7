"""Buses as a source: a thread for each reads into one bounded queue."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Protocol

import can

from tickrig.host.canmon.bus_reader import BusReader, open_bus
from tickrig.host.canmon.socket_reader import SocketReader
from tickrig.host.canmon.source_word import INTERFACES, BusWord
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.errors import LinkClosed
from tickrig.host.monitor.candump_filter import CandumpFilter, flagged_id
from tickrig.host.monitor.heard import Heard
from tickrig.host.monitor.logs.tally import Tally

QUEUE_FRAMES: Final = 200_000
"""Ten seconds of the busiest bus of 1 Mbit/s."""

WAIT_US: Final = 100_000
"""How long a thread may take to see that it shall end."""


class Reader(Protocol):
    """One bus that is open.

    Attributes:
        name: what it is called.
        lost: frames that its driver says it dropped.
        tally: what was no frame.
        stepped: its time passes while it is read, and it belongs to the thread that opened it.
    """

    name: str
    lost: int
    tally: Tally
    stepped: bool

    def read(self, timeout_us: int, /) -> list[Heard]:
        """Wait for a first frame; LinkClosed if the bus is gone."""
        ...

    def close(self) -> None:
        """Close the bus."""
        ...


def open_buses(words: Sequence[BusWord], options: BusOptions) -> BusSource:
    """Open the buses that are named, or none.

    Raises:
        Refused: options that python-can does not know.
        SourceFailed: a bus that cannot be opened.
    """
    readers: list[Reader] = []
    try:
        for word in words:
            readers.append(reader_of(*open_bus(merged(word, options))))
    except BaseException:
        for reader in readers:
            reader.close()
        raise
    return BusSource(readers, [word.chosen for word in words])


def reader_of(bus: can.BusABC, interface: str, name: str) -> Reader:
    """Return what reads an open bus."""
    return SocketReader(bus, name) if interface == "socketcan" else BusReader(bus, interface, name)


def merged(word: BusWord, options: BusOptions) -> BusOptions:
    """Return the options of a bus: what its word says goes before them."""
    return replace(
        options,
        interface=word.interface or options.interface,
        channel=word.channel or options.channel,
        bitrate=word.bitrate or options.bitrate,
        bus_kwargs=(*local(word.interface), *options.bus_kwargs),
    )


def local(interface: str | None) -> tuple[str, ...]:
    """Return what keeps frames on this machine, unless the command line says otherwise."""
    return ("hop_limit=0",) if interface == INTERFACES["udp"] else ()


class BusSource:
    """One or more buses, read by a thread each.

    What the caller does not fetch is kept up to a limit; frames beyond it are
    lost, and counted. A bus in virtual time is read by the caller itself: time
    passes while it polls.

    Args:
        readers: open buses.
        chosen: which frames of each are wanted.
        queue_frames: frames that are kept.
    """

    live = True

    def __init__(
        self,
        readers: Sequence[Reader],
        chosen: Sequence[CandumpFilter | None],
        queue_frames: int = QUEUE_FRAMES,
    ) -> None:
        self._readers, self._queue_frames = readers, queue_frames
        self._queue: deque[Heard] = deque()
        self._came, self._stop, self._overruns, self._failed = threading.Event(), False, 0, ""
        pairs = list(zip(readers, chosen, strict=True))
        self._stepped = [pair for pair in pairs if pair[0].stepped]
        self._threads = [
            threading.Thread(target=self._receive, args=pair, daemon=True)
            for pair in pairs
            if not pair[0].stepped
        ]
        for thread in self._threads:
            thread.start()

    @property
    def ended(self) -> bool:
        """Say that a bus is gone, and all that came was fetched."""
        return (bool(self._failed) or self._stop) and not self._queue

    @property
    def lost(self) -> int:
        """Frames that the drivers dropped or that found the queue full."""
        return self._overruns + sum(reader.lost for reader in self._readers)

    @property
    def failed(self) -> str:
        """Why a bus is gone."""
        return self._failed

    def poll(self, timeout_us: int, /) -> list[Heard]:
        """Wait for a first frame, then return all that are there."""
        for reader, chosen in self._stepped:
            self._take(reader, chosen, timeout_us)
        if not self._queue and not self._stepped and not self.ended:
            self._came.wait(timeout_us / 1e6)
        self._came.clear()
        return [self._queue.popleft() for _ in range(len(self._queue))]

    def words(self) -> list[str]:
        """Say what was no frame or got lost."""
        said = [word for reader in self._readers for word in reader.tally.words(reader.name)]
        said += [
            f"{one.name}: its driver lost {one.lost} frames" for one in self._readers if one.lost
        ]
        return said + ([f"{self._overruns} frames found the queue full"] if self._overruns else [])

    def close(self) -> None:
        """Close the buses."""
        if self._stop:
            return
        self._stop = True
        for thread in self._threads:
            thread.join()
        for reader in self._readers:
            reader.close()

    def _receive(self, reader: Reader, chosen: CandumpFilter | None) -> None:
        while not self._stop and not self._failed:
            self._take(reader, chosen, WAIT_US)
        self._came.set()

    def _take(self, reader: Reader, chosen: CandumpFilter | None, timeout_us: int) -> None:
        try:
            heard = reader.read(timeout_us)
        except LinkClosed as error:
            self._failed = str(error)
            return
        if chosen is not None:
            heard = [one for one in heard if chosen.passes(flagged_id(one))]
        room = self._queue_frames - len(self._queue)
        if len(heard) > room:
            self._overruns += len(heard) - room
            del heard[room:]
        self._queue += heard
        if heard:
            self._came.set()
