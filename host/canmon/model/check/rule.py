"""What a rule is asked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model.frames import ERROR, REMOTE, DumpLines, Record, Stamp, decoded_text
from tickrig.wire.can import STANDARD_MAX

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.frames import DumpLines


class TrafficFinding(NamedTuple):
    """What is wrong, where and when.

    Attributes:
        at_us: when it was seen.
        rule: name of the rule.
        text: what is wrong, in words.
        record: the frame that shows it, None if none does.
        around: the frames around that time, with what they mean, where somebody asked for them.
    """

    at_us: int
    rule: str
    text: str
    record: Record | None = None
    around: tuple[tuple[Record, Decoded], ...] = ()

    def __str__(self) -> str:
        """Write it as `line`, with a line as of `canmon dump` for each frame around it."""
        return self.shown(None)

    @property
    def line(self) -> str:
        """One line, time and frame as candump does.

        >>> TrafficFinding(1_500_000, "nodes", "node 3 was never heard").line
        '(1.500000) nodes: node 3 was never heard'
        """
        seconds, micros = divmod(self.at_us, 1_000_000)
        return self._line(f"({seconds}.{micros:06d})")

    def shown(self, lines: DumpLines | None) -> str:
        """Write it with its frames, and times as these lines have them; None: of the epoch."""
        head = self.line if lines is None else self._line(lines.stamp(self.at_us).strip())
        if not self.around:
            return head
        lines = lines or DumpLines(Stamp.ABSOLUTE)
        shown = [
            ("  >" if record is self.record else "   ") + lines.line(record, decoded_text(decoded))
            for record, decoded in self.around
        ]
        return "\n".join([head, *shown])

    def _line(self, stamp: str) -> str:
        shown = f" [{self.record.channel} {self.record.frame}]" if self.record else ""
        return f"{stamp} {self.rule}: {self.text}{shown}"


NO_GAP_US: Final = -1
"""Where a gap is compared: the first frame of an identifier has none."""


class FrameSelection(NamedTuple):
    """Which frames of an identifier a rule must see; no other can change what it finds.

    Where nothing is given, all of them.

    Attributes:
        below_us: frames after a shorter gap.
        above_us: frames after a longer gap.
        first_bytes: frames that begin with one of these.
        firsts: the first frame of an identifier on a bus.
    """

    below_us: int | None = None
    above_us: int | None = None
    first_bytes: frozenset[int] = frozenset()
    firsts: bool = False


class Seen(NamedTuple):
    """The frames of an identifier on a bus.

    Attributes:
        first_us: when the first one came.
        last_us: when the last one came.
        frames: how many came.
    """

    first_us: int
    last_us: int
    frames: int

    @property
    def has_gaps(self) -> bool:
        """Whether time passed from one to another."""
        return self.frames > 1 and self.first_us != self.last_us


class CheckedTraffic(NamedTuple):
    """What there was to be judged.

    Attributes:
        seen: the frames of each identifier on each bus, error frames beside.
        end_us: when listening ended.
        without_errors: why the source has no error frames whatever happened; empty if it may.
    """

    seen: Mapping[tuple[str, int], Seen]
    end_us: int
    without_errors: str = ""

    @property
    def untimed(self) -> bool:
        """Whether all frames have one time: it says nothing of gaps."""
        times = {us for one in self.seen.values() for us in (one.first_us, one.last_us)}
        return len(times) == 1 and sum(one.frames for one in self.seen.values()) > 1

    def on(self, ident: int) -> list[Seen]:
        """Return the frames of an identifier, bus by bus."""
        return [one for (_, other), one in self.seen.items() if other == ident]

    @property
    def without_canopen(self) -> str:
        """Say that no frame can be one of CANopen; empty if some can."""
        if any(not ident & ~(REMOTE | STANDARD_MAX) for _, ident in self.seen):
            return ""
        return "no classic frame with an 11-bit CAN-ID came"


ONE_TIME: Final = "all frames have one time"


class Rule:
    """One rule; this one sees all frames that it wants, and has nothing to say at the end.

    Attributes:
        name: as findings and reports have it.
    """

    name = ""

    def wants(self, ident: int, /) -> bool:
        """Say whether frames of an identifier matter; error frames have `ident.ERROR`."""
        raise NotImplementedError

    def selection(self, ident: int, /) -> FrameSelection:
        """Say which frames of an identifier that it wants it must see."""
        return FrameSelection()

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Say what is wrong with a frame.

        Args:
            record: the frame.
            gap_us: since the one before it with this identifier on this bus; None for the first.
        """
        raise NotImplementedError

    def begin(self, at_us: int, /) -> None:
        """Take the time of the first frame of all, before any is judged."""
        return

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Say why it has judged nothing, so that nobody takes it for one that holds.

        A rule judges each frame that it wants, error frames also by their absence; one with an
        `end` of its own judges what is missing.

        Args:
            evidence: at least one frame, or error frame.

        Returns:
            The reason; empty if it has judged something.
        """
        by_absence = type(self).end is not Rule.end or self.wants(ERROR)
        if by_absence or any(self.wants(ident) for _, ident in evidence.seen):
            return ""
        return "no frame that it is about came"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Say what it could not judge beside what it has judged."""
        return ()

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Say what is missing.

        Args:
            latest_us: when each identifier was heard last, on any bus.
            end_us: when listening ended.
        """
        return ()
