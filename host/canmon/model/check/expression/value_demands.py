"""Demands on the values of signals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.canmon.model.check.expression.demand import Demand
from tickrig.host.canmon.model.check.expression.event import Event, Sender, said, sender_of
from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.frames.quantity import ms_text
from tickrig.host.canmon.model.frames.record import Record

EMCY: Final = "emcy"


@dataclass(frozen=True, slots=True)
class Values:
    """Values that are right.

    Attributes:
        text: as they are written.
        holds: says whether a signal has one of them.
    """

    text: str
    holds: Callable[[Signal], bool]


class In(Demand):
    """A value is one of those that are right.

    A signal is told when it begins to be wrong; of other events each frame is. An EMCY of code
    0000h takes an error back, and is right.

    Args:
        event: a signal, or frames of a kind, whose first value counts.
        values: what is right.
    """

    def __init__(self, event: Event, values: Values) -> None:
        self._event, self._value_of, self._values = event, event.value_of(), values
        self._once = event.is_signal
        self.doubt = f"no value of {event.text} came while it was in force"
        self._wrong: set[Sender] = set()

    def pause(self) -> None:
        """Tell it again."""
        self._wrong.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the value."""
        signal = self._value_of(record, decoded)
        if signal is None:
            return None
        self.judged = True
        sender = sender_of(record)
        if self._values.holds(signal) or (decoded.kind == EMCY and not signal.value):
            self._wrong.discard(sender)
            return None
        if self._once and sender in self._wrong:
            return None
        self._wrong.add(sender)
        return f"{said(decoded)}; {self._event.text} in {self._values.text} is right"


class Follow(Demand):
    """Each value is compared with the one before it, of the same identifier.

    Args:
        event: as of `In`.
    """

    def __init__(self, event: Event) -> None:
        self._value_of = event.value_of()
        self._last: dict[Sender, tuple[float, int | None]] = {}
        self.doubt = f"no two values of {event.text} came from one sender while it was in force"

    def begin(self, at_us: int) -> None:
        """Forget what was before."""
        self._last.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare it; a boot-up begins anew."""
        if decoded.kind == "boot-up":
            self._last = {
                sender: last
                for sender, last in self._last.items()
                if (sender[0], last[1]) != (record.channel, decoded.node)
            }
        signal = self._value_of(record, decoded)
        if signal is None or not isinstance(signal.value, int | float):
            return None
        sender = sender_of(record)
        before = self._last.get(sender)
        self._last[sender] = signal.value, decoded.node
        self.judged |= before is not None
        return None if before is None else self._compare(sender, before[0], signal)

    def _compare(self, sender: Sender, before: float, signal: Signal) -> str | None:
        raise NotImplementedError


class Counts(Follow):
    """A counter goes up by one, and round to 0 or 1 from the highest value that it had."""

    def __init__(self, event: Event) -> None:
        super().__init__(event)
        self._highest: dict[Sender, float] = {}

    def _compare(self, sender: Sender, before: float, signal: Signal) -> str | None:
        value = signal.value
        assert isinstance(value, int | float)
        highest = self._highest[sender] = max(before, self._highest.get(sender, before))
        if value == before + 1 or (value in (0, 1) and before == highest):
            return None
        return f"{signal.name} is {value:g} after {before:g}, one more is right"


class Steps(Follow):
    """A value changes from frame to frame by so much at most.

    Args:
        event: as of `In`.
        most: the largest change.
    """

    def __init__(self, event: Event, most: float) -> None:
        super().__init__(event)
        self._most = most

    def _compare(self, sender: Sender, before: float, signal: Signal) -> str | None:
        value = signal.value
        assert isinstance(value, int | float)
        if abs(value - before) <= self._most:
            return None
        return f"{signal.name} is {value:g} after {before:g}, a step of {self._most:g} is right"


class Changes(Demand):
    """A value does not stay the same for too long; it is told once.

    Args:
        event: as of `In`.
        most_us: how long it may stay the same.
    """

    timed = True

    def __init__(self, event: Event, most_us: int) -> None:
        self._value_of, self._most_us = event.value_of(), most_us
        self.doubt = f"no two values of {event.text} came from one sender while it was in force"
        self._since: dict[Sender, tuple[object, int, bool]] = {}

    def begin(self, at_us: int) -> None:
        """Forget what was before."""
        self._since.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare it with the one before."""
        signal = self._value_of(record, decoded)
        if signal is None:
            return None
        sender, at_us = sender_of(record), record.at_us
        value, since_us, told = self._since.get(sender, (None, at_us, False))
        self.judged |= sender in self._since
        if sender not in self._since or value != signal.value:
            self._since[sender] = signal.value, at_us, False
            return None
        if told or at_us - since_us <= self._most_us:
            return None
        self._since[sender] = value, since_us, True
        stayed = f"{signal} has not changed for {ms_text(at_us - since_us)} ms"
        return f"{stayed}, at most {ms_text(self._most_us)} is right"
