"""Where frames come from: buses, log files or standard input, under one face."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

from tickrig.host.canmon.model.frames.record import Record

if TYPE_CHECKING:
    from tickrig.host.canmon.model.logs.mark import Mark
    from tickrig.host.canmon.model.logs.tally import Tally

Taken_co = TypeVar("Taken_co", covariant=True)


class AnySource(Generic[Taken_co]):
    """Frames, or lines of a serial port, as they come in.

    Attributes:
        live: it goes on by itself; False where all of it is there already.
        failed: why it ended before its time; empty if it did not.
        marks: what happened behind the frames that `poll` returned last.
        recorded: a recorder wrote these marks, and has said them.
    """

    live = recorded = False
    failed = ""
    marks: Sequence[Mark] = ()
    _ended = False

    @property
    def ended(self) -> bool:
        """Whether no more will come."""
        return self._ended

    @property
    def away(self) -> Sequence[str]:
        """Buses that went away and are not back."""
        return ()

    @property
    def gaps(self) -> int:
        """How often a bus went away and was to be opened again."""
        return 0

    def reopen(self) -> None:
        """Open buses again that go away; what has an end is left alone."""
        return

    def tallies(self) -> Iterable[tuple[str, Tally]]:
        """Return what was no frame, by the name of each bus or file."""
        return ()

    @property
    def lost(self) -> int:
        """Frames that were there and did not get here, as far as anybody told."""
        return sum(tally.lost for _, tally in self.tallies())

    @property
    def unread(self) -> int:
        """Lines and frames that got here and could not be taken, as noise and CAN FD."""
        return sum(tally.unread for _, tally in self.tallies())

    def poll(self, timeout_us: int, /) -> Sequence[Taken_co]:
        """Wait for a first frame, then return all that are there; none if none came."""
        return []

    def messages(self) -> list[str]:
        """Say what was no frame or got lost, one line each."""
        return [text for name, tally in self.tallies() for text in tally.messages(name)]

    def losses(self) -> list[str]:
        """Say what of it got lost or could not be taken: not what is no frame by its nature."""
        return [text for name, tally in self.tallies() for text in tally.losses(name)]

    def errors(self) -> list[str]:
        """Say what of it tells of errors on the bus beside error frames."""
        return [text for name, tally in self.tallies() for text in tally.errors(name)]

    @property
    def without_errors(self) -> str:
        """Why no error frame can come, whatever happens; empty if some can."""
        told = [tally.without_errors for _, tally in self.tallies()]
        return told[0] if told and all(told) else ""

    def close(self) -> None:
        """Give back what it holds; closing twice is no error."""
        self._ended = True


Source = AnySource[Record]
