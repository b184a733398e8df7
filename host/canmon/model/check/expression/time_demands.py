"""Demands on when something comes."""

from __future__ import annotations

from collections.abc import Iterable

from tickrig.host.canmon.model.check.expression.demand import Demand, Fault
from tickrig.host.canmon.model.check.expression.event import Event, Sender, said, sender_of
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.sdo.transfer import Outcome
from tickrig.host.canmon.model.frames.quantity import ms_text
from tickrig.host.canmon.model.frames.record import Record
from tickrig.wire.instant import NEVER


class Every(Demand):
    """Frames of an identifier come again in time; the first after a boot-up when it likes.

    Args:
        event: the frames.
        low_us: no sooner.
        high_us: no later; None for any time.
    """

    timed = True

    def __init__(self, event: Event, low_us: int, high_us: int | None) -> None:
        self._event, self._low_us, self._high_us = event, low_us, high_us
        self.doubt = f"{event.text} did not come twice from one sender while it was in force"
        self._last: dict[Sender, tuple[int, int | None]] = {}

    def begin(self, at_us: int) -> None:
        """Measure from the next frame."""
        self._last.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the gap."""
        if decoded.kind == "boot-up":
            self._forget(record.channel, decoded.node)
        if not self._event.matches(record, decoded):
            return None
        self.came = True
        sender = sender_of(record)
        before = self._last.get(sender)
        self._last[sender] = record.at_us, decoded.node
        if before is None:
            return None
        self.judged = True
        gap_us = max(0, record.at_us - before[0])
        return self._wrong(gap_us, decoded.node, "after the one before")

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Say that it stopped or never came."""
        if not running or self._high_us is None:
            return
        if not self.came:
            yield f"{self._event.text} never came"
        for at_us, node in self._last.values():
            if end_us - at_us > self._high_us:
                yield self._wrong(end_us - at_us, node, "without another") or ""

    def _forget(self, channel: str, node: int | None) -> None:
        last = self._last.items()
        self._last = {key: one for key, one in last if (key[0], one[1]) != (channel, node)}

    def _wrong(self, gap_us: int, node: int | None, how: str) -> str | None:
        high_us = self._high_us
        if self._low_us <= gap_us and (high_us is None or gap_us <= high_us):
            return None
        right = f"{ms_text(self._low_us)} to {ms_text(high_us)}" if high_us is not None else ""
        right = right or f"at least {ms_text(self._low_us)}"
        whose = "" if node is None else f"node {node}: "
        return f"{whose}{ms_text(gap_us)} ms {how}, {right} is right"


class FirstWithin(Demand):
    """A frame comes in time after the beginning: of the traffic, or of the scope.

    Args:
        event: the frame.
        most_us: how long it may take.
    """

    timed = True

    def __init__(self, event: Event, most_us: int) -> None:
        self._event, self._most_us, self.due_us = event, most_us, NEVER
        self.doubt = f"it ends before {ms_text(most_us)} ms have passed, without {event.text}"

    def begin(self, at_us: int) -> None:
        """Wait for it."""
        self.due_us = at_us + self._most_us

    def pause(self) -> None:
        """Wait no longer."""
        self.due_us = NEVER

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """See whether it has come."""
        if self.due_us != NEVER and self._event.matches(record, decoded):
            self.due_us, self.judged = NEVER, True
        return None

    def expire(self) -> Iterable[Fault]:
        """Say that it has not."""
        due_us, self.due_us, self.judged = self.due_us, NEVER, True
        yield Fault(due_us, f"no {self._event.text} in {ms_text(self._most_us)} ms")


Pair = tuple[str, int | None]
"""A bus, and a node where those that belong together are told by it."""


class Waiting(Demand):
    """Something comes in time after each frame that it belongs to.

    Args:
        most_us: how long it may take.
    """

    timed = True

    def __init__(self, most_us: int) -> None:
        self._most_us, self.due_us = most_us, NEVER
        self._open: dict[Pair, tuple[Record, str]] = {}

    def begin(self, at_us: int) -> None:
        """Wait for nothing yet."""
        self._close_all()

    def pause(self) -> None:
        """Wait no longer."""
        self._close_all()

    def expire(self) -> Iterable[Fault]:
        """Say what has not come."""
        due_us, self.judged = self.due_us, True
        late = [pair for pair, (record, _) in self._open.items() if self._due(record) <= due_us]
        for pair in late:
            record, text = self._open[pair]
            self._close(pair)
            yield Fault(due_us, f"{text} in {ms_text(self._most_us)} ms", record)

    def _await(self, pair: Pair, record: Record, text: str) -> None:
        if pair not in self._open:
            self._open[pair] = record, text
            self.due_us = min(self.due_us, self._due(record))

    def _close(self, pair: Pair) -> None:
        if self._open.pop(pair, None) is not None:
            self.judged = True
            dues = (self._due(record) for record, _ in self._open.values())
            self.due_us = min(dues, default=NEVER)

    def _close_all(self) -> None:
        self._open.clear()
        self.due_us = NEVER

    def _due(self, record: Record) -> int:
        return record.at_us + self._most_us


class Latency(Waiting):
    """One event follows another in time.

    Where the first comes again meanwhile, the time since the earlier one counts. Events that
    name no node belong together by the nodes of their frames.

    Args:
        first: what begins it.
        second: what must follow.
        most_us: how long it may take.
    """

    def __init__(self, first: Event, second: Event, most_us: int) -> None:
        super().__init__(most_us)
        self._first, self._second = first, second
        self._by_node = not (first.has_node or second.has_node)
        self.doubt = f"no {first.text} came that has {ms_text(most_us)} ms behind it"

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Close what has followed, then begin."""
        node = decoded.node if self._by_node else None
        if self._second.matches(record, decoded):
            self._close((record.channel, node))
            self._close((record.channel, None))
        if self._first.matches(record, decoded):
            self._await((record.channel, node), record, f"{said(decoded)}: no {self._second.text}")
        return None


class Answered(Waiting):
    """Requests are answered in time: of an SDO client, and of a master that guards.

    One that is sent again is measured from the first.

    Args:
        event: the requests.
        most_us: how long it may take.
    """

    def __init__(self, event: Event, most_us: int) -> None:
        super().__init__(most_us)
        self._event = event
        self.doubt = f"no request of {event.text} came that has {ms_text(most_us)} ms behind it"

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Close what is answered, or left for another request; then begin."""
        is_sdo = decoded.kind == "sdo"
        if not (is_sdo or decoded.kind in ("guard", "heartbeat", "boot-up")):
            return None
        pair = f"{record.channel} {'sdo' if is_sdo else 'guard'}", decoded.node
        left = any(one.outcome is Outcome.UNANSWERED for one in decoded.transfers)
        before = self._open.get(pair) if left else None
        if left or not decoded.asks:
            self._close(pair)
        if decoded.asks and self._event.matches(record, decoded):
            self._await(pair, record, f"{said(decoded)}: not answered")
        return f"{before[1]} before the next request" if before else None
