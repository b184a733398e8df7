"""What is demanded of frames, while the scope of its rule holds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames.record import Record
from tickrig.wire.instant import NEVER


class Fault(NamedTuple):
    """What is wrong, and when.

    Attributes:
        at_us: when it was seen.
        text: what is wrong, in words.
        record: the frame that shows it, None if none does.
    """

    at_us: int
    text: str
    record: Record | None = None


class Demand:
    """One demand; this one is always met. What it keeps grows with identifiers at most.

    Attributes:
        due_us: until when something must have come.
        came: a frame came that it counts; where it counts none, False.
        judged: something was compared with what is demanded.
        timed: it is about time: where all frames have one, nothing is judged.
        doubt: why nothing was judged, where nothing was.
    """

    due_us: int = NEVER
    came: bool = False
    judged: bool = False
    timed: bool = False
    doubt: str = "no frame came while it was in force"

    def begin(self, at_us: int) -> None:
        """Begin, or begin anew after a pause."""

    def pause(self) -> None:
        """Demand nothing until `begin`."""

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Say what is wrong with a frame."""
        return None

    def expire(self) -> Iterable[Fault]:
        """Say what has not come until `due_us`, once."""
        return ()

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Say what is missing.

        Args:
            end_us: when listening ended, or the time where it goes on.
            running: the scope holds.
        """
        return ()
