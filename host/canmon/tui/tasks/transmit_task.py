"""The transmit list on a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from tickrig.host.canmon.tui.tasks.model import Meant
from tickrig.host.monitor.decode.objects.eds_objects import EdsObjects
from tickrig.host.monitor.transmit.pdo_words import PdoWords
from tickrig.host.monitor.transmit.transmit_list import TransmitList
from tickrig.host.monitor.transmit.transmit_words import TransmitWords
from tickrig.wire.can import CanFrame, Frames

NOW: Final = 0
"""When frames are due that somebody sends by hand."""


class TransmitTask:
    """Sends rows of a list: cyclically, or by hand.

    Args:
        eds: what files say, by node-ID.
        channel: the bus it sends on; empty for the first.

    Attributes:
        words: what each row says.
        list: the rows.
    """

    def __init__(self, eds: Mapping[int, EdsObjects], channel: str = "") -> None:
        self.channel = channel
        self.words: list[TransmitWords] = []
        self.list = TransmitList()
        self._pdos = PdoWords(eds)
        self._out: list[CanFrame] = []

    @property
    def due_us(self) -> int:
        """When it next wants to be called."""
        return NOW if self._out else self.list.due_us

    def add(self, words: TransmitWords) -> None:
        """Add a row at the end; ValueError if it cannot be sent."""
        self.list.rows.append(words.row(self._pdos))
        self.words.append(words)

    def change(self, number: int, words: TransmitWords) -> None:
        """Put another row in the place of one, which sends no more; ValueError as `add`."""
        self.list.rows[number] = words.row(self._pdos)
        self.words[number] = words

    def remove(self, number: int) -> None:
        """Take out a row."""
        del self.list.rows[number], self.words[number]

    def enable(self, number: int, now_us: int, *, armed: bool) -> None:
        """Send a row in each period, or no more if it does; ValueError if that must not be."""
        row = self.list.rows[number]
        if row.enabled:
            row.disable()
            return
        self.list.armed = armed
        self.list.enable(number, now_us)

    def once(self, number: int, *, armed: bool) -> None:
        """Send a row now; ValueError if it is not armed."""
        self.list.armed = armed
        self._out += self.list.once(number)

    def tick(self, now_us: int, heard: Sequence[Meant], /) -> Frames:
        """Return what is due."""
        out, self._out = self._out, []
        return (*out, *self.list.tick(now_us))

    def stop(self) -> None:
        """Disable all rows."""
        self.list.stop()
        self._out.clear()
