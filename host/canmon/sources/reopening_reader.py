"""A reader that is opened again where its bus or port went away."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.model.logs.mark import Mark, back, gone
from tickrig.host.cli.messages import Refused
from tickrig.host.links.link import LinkClosed

if TYPE_CHECKING:
    from tickrig.host.canmon.model.frames import LineRecord, Record
    from tickrig.host.canmon.sources.live_source import Reader

REOPEN_US: Final = 500_000
"""How long to wait before it is tried again."""

Item = TypeVar("Item", bound="Record | LineRecord")


def _monotonic_us() -> int:
    return time.monotonic_ns() // 1_000


class ReopeningReader(Generic[Item]):
    """A reader over readers of which each is used until its bus is gone.

    Until somebody sets `wanted` it is as the first of them. A bus is back when it was opened and
    read without an error: one of SocketCAN that is down can be opened.

    Args:
        reader: the first; it is open.
        open_reader: opens the next.
        clock: microseconds, of any origin.
        wait: sleeps for so many seconds.

    Attributes:
        name: that of the first.
        tally: what was no frame in any of them.
        stepped: never.
        wanted: whether it shall be opened again.
        gaps: how often it went away.
    """

    stepped = False

    def __init__(
        self,
        reader: Reader[Item],
        open_reader: Callable[[], Reader[Item]],
        clock: Callable[[], int] = _monotonic_us,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self.name, self.tally, self.wanted, self.gaps = reader.name, reader.tally, False, 0
        self._reader: Reader[Item] | None = reader
        self._open_reader, self._clock, self._wait = open_reader, clock, wait
        self._gone_us: int | None = None
        self._lost = self._away_us = self._due_us = 0

    @property
    def lost(self) -> int:
        """Frames that the driver says it dropped, in all readers together."""
        return self._lost + (0 if self._reader is None else self._reader.lost)

    @property
    def away(self) -> bool:
        """Whether the bus is gone now."""
        return self._gone_us is not None

    def read(self, timeout_us: int, /) -> Sequence[Item | Mark]:
        """Wait for a first frame; tell by a mark that the bus went, or is there again.

        Raises:
            LinkClosed: the bus is gone, and nobody wants it to be opened again.
        """
        try:
            reader = self._reader or self._opened(timeout_us)
            records: Sequence[Item | Mark] = () if reader is None else reader.read(timeout_us)
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
        """Say for how long it was away."""
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

    def _opened(self, timeout_us: int) -> Reader[Item] | None:
        """Try once more, or wait until that is due."""
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
        """Close what is gone; say so the first time."""
        self.close()
        now_us = self._clock()
        self._due_us = now_us + REOPEN_US
        if self._gone_us is not None:
            return ()
        self._gone_us, self.gaps = now_us, self.gaps + 1
        return [gone(time.time_ns() // 1_000, self.name, why)]
