"""A live source, in which a thread for each port reads into one bounded queue."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import repeat
from queue import Empty
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

from tickrig.host.canmon.model.frames import CandumpFilter, Record, flagged_id
from tickrig.host.canmon.model.logs.log_file import LogTally, Mark, back, gone
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import WaitingQueue

if TYPE_CHECKING:
    from tickrig.host.canmon.model.frames import LineRecord


_QUEUE_FRAMES: Final = 200_000
"""Number of frames in the queue, which is ten seconds of the busiest bus of 1 Mbit/s."""

_WAIT_US: Final = 100_000
"""Longest time until a thread notices that it must end."""

_Item = TypeVar("_Item", bound="Record | LineRecord")
_Read_co = TypeVar("_Read_co", bound="Record | LineRecord", covariant=True)


class Reader(Protocol[_Read_co]):
    """Reader of one open bus or serial port, which a `LiveSource` combines with others.

    Attributes:
        name: name of the bus or port.
        tally: counts of items that were not returned as frames, such as unreadable frames.
        stepped: whether virtual time passes only while the bus is read. Such a bus may be read only
            by the thread that opened it.
    """

    name: str
    tally: LogTally
    stepped: bool

    @property
    def lost(self) -> int:
        """Number of frames that the driver reports as dropped."""

    def read(self, timeout_us: int, /) -> Sequence[_Read_co | Mark]:
        """Wait at most `timeout_us` for a first frame, and return the frames that have arrived.

        A mark at the beginning of the result means that the bus went away or is back.

        Raises:
            LinkClosed: the bus is gone.
        """

    def close(self) -> None:
        """Close the bus."""


class LiveSource(AnySource[_Item]):
    """Source of frames from one or more buses or serial ports.

    Each bus in real time and each serial port has its own thread. Frames wait in a queue of limited
    size until the caller fetches them. If the queue is full, further frames are lost and counted.

    A bus in virtual time has no thread. The caller reads such a bus by `poll`, and its time passes
    during this call.

    Args:
        readers: readers of the open buses and ports.
        chosen: filter for the frames of each reader, or None for all frames.
        queue_frames: maximum number of frames in the queue.

    Attributes:
        failed: reason why a bus is gone, empty for none.
    """

    live = True

    def __init__(
        self,
        readers: Sequence[Reader[_Item]],
        chosen: Iterable[CandumpFilter | None] = repeat(None),
        queue_frames: int = _QUEUE_FRAMES,
    ) -> None:
        self._readers, self._queue_frames = readers, queue_frames
        self._queue: deque[_Item | Mark] = deque()
        self._marking: deque[None] = deque()  # an entry for each mark in the queue
        self._came: WaitingQueue[None] = WaitingQueue()
        self._stop, self._overruns, self.failed = False, 0, ""
        pairs = list(zip(readers, chosen, strict=False))
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
        """Whether a bus is gone, and all received frames were read."""
        return (bool(self.failed) or self._stop) and not self._queue

    @property
    def away(self) -> list[str]:
        """Buses that went away and are not back."""
        return [one.name for one in self._reopening() if one.away]

    @property
    def gaps(self) -> int:
        """Number of times that a bus went away and had to be opened again."""
        return sum(one.gaps for one in self._reopening())

    def reopen(self) -> None:
        """From now on, open buses that go away again, until they are back."""
        for one in self._reopening():
            one.wanted = True

    def tallies(self) -> Iterable[tuple[str, LogTally]]:
        """Return a pair for each bus or port: its name and its `LogTally`.

        The tally counts items that are not frames, such as invalid lines.
        """
        return [(reader.name, reader.tally) for reader in self._readers]

    @property
    def lost(self) -> int:
        """Number of frames that the drivers dropped or that did not fit the queue."""
        return self._overruns + sum(reader.lost for reader in self._readers)

    def poll(self, timeout_us: int, /) -> list[_Item]:
        """Wait at most `timeout_us` for a first frame.

        Return all frames that have arrived. A mark is an event among the frames, such as a bus that
        went away. If a mark has arrived, return only the frames before it.
        """
        self.marks = ()
        for reader, chosen in self._stepped:
            self._take(reader, chosen, timeout_us)
        if not self._queue and not self._stepped and not self.ended:
            with suppress(Empty):
                self._came.get(timeout_us / 1e6)
        self._came.clear()
        if self._marking:
            return self._up_to_mark()
        return [self._queue.popleft() for _ in range(len(self._queue))]  # type: ignore[misc]

    def messages(self) -> list[str]:
        """Report invalid and lost frames."""
        remarks = (text for name, tally in self.tallies() for text in tally.remarks(name))
        return [*self.losses(), *remarks]

    def losses(self) -> list[str]:
        """Report lost and unreadable frames."""
        said = super().losses() + [text for one in self._reopening() for text in one.losses()]
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

    def _reopening(self) -> list[ReopeningReader[_Item]]:
        return [one for one in self._readers if isinstance(one, ReopeningReader)]

    def _up_to_mark(self) -> list[_Item]:
        batch: list[_Item] = []
        while self._queue:
            one = self._queue.popleft()
            if isinstance(one, Mark):
                self._marking.popleft()
                self.marks = (one,)
                break
            batch.append(one)
        return batch

    def _receive(self, reader: Reader[_Item], chosen: CandumpFilter | None) -> None:
        while not self._stop and not self.failed:
            self._take(reader, chosen, _WAIT_US)
        self._came.put(None)

    def _take(self, reader: Reader[_Item], chosen: CandumpFilter | None, timeout_us: int) -> None:
        try:
            records = reader.read(timeout_us)
        except LinkClosed as error:
            self.failed = str(error)
            return
        if records and isinstance(records[0], Mark):
            self._marking.append(None)
            self._queue.append(records[0])
            self._came.put(None)
            records = records[1:]
        if chosen is not None:
            records = [one for one in records if _passes(chosen, one)]
        room = self._queue_frames - len(self._queue)
        if len(records) > room:
            self._overruns += len(records) - room
            records = records[:room]
        self._queue += records
        if records:
            self._came.put(None)


def _passes(chosen: CandumpFilter, one: Record | LineRecord | Mark) -> bool:
    return not isinstance(one, Record) or chosen.passes(flagged_id(one))


# A reader that is opened again where its bus or port went away.


REOPEN_US: Final = 500_000
"""Time to wait before opening a bus is tried again."""


def _monotonic_us() -> int:
    return time.monotonic_ns() // 1_000


class ReopeningReader(Generic[_Item]):
    """A reader that opens its bus again. It uses one reader until the bus is gone, then the next.

    Until `wanted` is set, it acts like the first reader. A bus is back when it was opened and then
    read without an error. Opening alone is not enough, because a SocketCAN bus that is down can be
    opened.

    Args:
        reader: first reader, which is open.
        open_reader: function that opens the next reader.
        clock: function that returns microseconds, with any origin.
        wait: function that sleeps for a number of seconds.

    Attributes:
        name: name of the first reader.
        tally: counts of items that were not returned as frames, of all readers.
        stepped: whether virtual time passes while the bus is read, which is always False.
        wanted: whether to open the bus again.
        gaps: number of times that the bus went away.
    """

    stepped = False

    def __init__(
        self,
        reader: Reader[_Item],
        open_reader: Callable[[], Reader[_Item]],
        clock: Callable[[], int] = _monotonic_us,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self.name, self.tally, self.wanted, self.gaps = reader.name, reader.tally, False, 0
        self._reader: Reader[_Item] | None = reader
        self._open_reader, self._clock, self._wait = open_reader, clock, wait
        self._gone_us: int | None = None
        self._lost = self._away_us = self._due_us = 0

    @property
    def lost(self) -> int:
        """Number of frames that the driver reports as dropped, of all readers together."""
        return self._lost + (0 if self._reader is None else self._reader.lost)

    @property
    def away(self) -> bool:
        """Whether the bus is gone now."""
        return self._gone_us is not None

    def read(self, timeout_us: int, /) -> Sequence[_Item | Mark]:
        """Wait at most `timeout_us` for a first frame, and return the frames that have arrived.

        If the bus went away or is back, the result contains marks that report this.

        Raises:
            LinkClosed: the bus is gone, and the attribute `wanted` is False, so that the bus is not
                opened again.
        """
        try:
            reader = self._reader or self._opened(timeout_us)
            records: Sequence[_Item | Mark] = () if reader is None else reader.read(timeout_us)
        except LinkClosed as error:
            if not self.wanted:
                raise
            return self._leave(str(error))
        if reader is None or self._gone_us is None:
            return records
        away_us = self._clock() - self._gone_us
        self._gone_us, self._away_us = None, self._away_us + away_us
        return [back(time.time_ns() // 1_000, self.name, away_us), *records]

    def losses(self) -> list[str]:
        """Report how long the bus was away."""
        if not self.gaps:
            return []
        now_away_us = 0 if self._gone_us is None else self._clock() - self._gone_us
        times = "once" if self.gaps == 1 else f"{self.gaps} times"
        away_s = (self._away_us + now_away_us) / 1e6
        still = ", and is not back" if self.away else ""
        return [f"{self.name}: it was away {times}, {away_s:.3f} s in all{still}"]

    def close(self) -> None:
        """Close the bus."""
        if self._reader is not None:
            self._lost = self.lost
            reader, self._reader = self._reader, None
            reader.close()

    def _opened(self, timeout_us: int) -> Reader[_Item] | None:
        """Try to open the bus once more, or wait until the next try is due."""
        early_us = self._due_us - self._clock()
        if early_us > 0:
            self._wait(min(early_us, timeout_us) / 1e6)
            return None
        try:
            reader = self._open_reader()
        except (SourceFailed, Refused, OSError) as error:
            raise LinkClosed(str(error)) from error
        reader.tally, self._reader = self.tally, reader
        return reader

    def _leave(self, why: str) -> Sequence[Mark]:
        """Close the reader whose bus is gone. Report this the first time."""
        self.close()
        now_us = self._clock()
        self._due_us = now_us + REOPEN_US
        if self._gone_us is not None:
            return ()
        self._gone_us, self.gaps = now_us, self.gaps + 1
        return [gone(time.time_ns() // 1_000, self.name, why)]
