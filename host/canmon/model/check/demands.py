"""Demands on the frequency, form, time and values of frames."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal, TransferOutcome
from tickrig.host.canmon.model.decode.filter import Test, signal_reader
from tickrig.host.canmon.model.frames import ERROR, Record, any_ident, ms_text
from tickrig.host.text.values import counted
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.instant import NEVER

# The events of a rule.


@dataclass(frozen=True, slots=True)
class RuleEvent:
    """The event of a rule, which is a frame that passes a filter.

    Attributes:
        text: text of the filter.
        matches: function that returns whether a frame passes.
        paths: signals that the filter names.
        is_signal: whether the filter is a single signal without a comparison.
        has_node: whether the filter names a node.
    """

    text: str
    matches: Test
    paths: tuple[str, ...] = ()
    is_signal: bool = False
    has_node: bool = False

    def carriers(self) -> Callable[[Decoded], bool]:
        """Return a function that returns whether a frame contains one of the named signals."""
        finders = [signal_reader(path) for path in self.paths]
        return lambda decoded: any(find(decoded) is not None for find in finders)

    def value_of(self) -> Callable[[Record, Decoded], Signal | None]:
        """Return a function that finds the named signal in a frame, or else its first signal."""
        matches = self.matches
        if self.is_signal:
            finders = [signal_reader(path) for path in self.paths]
            return lambda record, decoded: next(filter(None, (f(decoded) for f in finders)), None)
        return lambda record, decoded: (
            decoded.signals[0] if decoded.signals and matches(record, decoded) else None
        )


EVERY: Final = RuleEvent("all frames", lambda record, decoded: True)

_Sender = tuple[str, int]
"""A bus, and an identifier on this bus."""


def _sender_of(record: Record) -> _Sender:
    """Return the sender of a frame. All error frames have the same sender."""
    frame = record.frame
    return record.channel, ERROR if isinstance(frame, ErrorFrame) else any_ident(frame)


def _said(decoded: Decoded) -> str:
    """Return the meaning of a frame as text for a finding."""
    node = "" if decoded.node is None else f" of node {decoded.node}"
    return f"{decoded.kind}{node}: {decoded.text}".removesuffix(": ")


# Demands on frames, which apply in the scope of their rule.


class RuleBreach(NamedTuple):
    """A violation and its time.

    Attributes:
        at_us: time at which the violation was detected.
        text: description of the violation.
        record: frame that shows the violation, or None if no frame does.
    """

    at_us: int
    text: str
    record: Record | None = None


class RuleDemand:
    """One demand of a rule. This base class is always met.

    The memory of a demand grows at most with the number of identifiers.

    Attributes:
        due_us: time by which a frame must have arrived.
        came: whether a frame that the demand counts has arrived. The value is False if the demand
            counts no frames.
        judged: whether a frame was compared with the demand.
        timed: whether the demand is about time. Such a demand judges nothing if all frames have the
            same time.
        doubt: reason why nothing was judged, empty if something was judged.
    """

    due_us: int = NEVER
    came: bool = False
    judged: bool = False
    timed: bool = False
    doubt: str = "no frame came while it was in force"

    def begin(self, at_us: int) -> None:
        """Start, also after a pause."""

    def pause(self) -> None:
        """Stop the demand until `begin`."""

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Return the violation in a frame."""
        return None

    def expire(self) -> Iterable[RuleBreach]:
        """Report once that a frame has not arrived by `due_us`."""
        return ()

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Return a description of each frame that is missing at the end.

        Args:
            end_us: the end of the traffic, or the current time if it continues.
            running: whether the scope of the rule applies.
        """
        return ()


# Demands on the frequency of frames.

MOST_COUNTED: Final = 10_000
"""Largest number of frames that a rule may allow in a span, because their times are kept."""


class Truth(RuleDemand):
    """Demand that a condition on signals is always true, or never true.

    A violation is reported when it starts, not with each frame.

    Args:
        event: condition on signals.
        wanted: required value of the condition.
    """

    def __init__(self, event: RuleEvent, wanted: bool) -> None:
        self._matches, self._carries, self._wanted = event.matches, event.carriers(), wanted
        self._wrong: set[_Sender] = set()
        self.doubt = f"nothing with {event.text} came while it was in force"

    def pause(self) -> None:
        """Allow the violation to be reported again."""
        self._wrong.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the condition with its required value."""
        if not self._carries(decoded):
            return None
        self.judged = True
        sender = _sender_of(record)
        if self._matches(record, decoded) is self._wanted:
            self._wrong.discard(sender)
        elif sender not in self._wrong:
            self._wrong.add(sender)
            return _said(decoded)
        return None


class Never(RuleDemand):
    """Demand that certain frames never arrive. Each such frame is reported.

    Args:
        event: frames that must not arrive.
    """

    def __init__(self, event: RuleEvent) -> None:
        self._matches = event.matches

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Report the frame as a violation."""
        self.judged = True
        return _said(decoded) if self._matches(record, decoded) else None


class Count(RuleDemand):
    """A limit of the number of frames.

    Args:
        event: frames to count.
        least: smallest allowed number. Too few frames are reported at the end.
        most: largest allowed number, or None for no limit. An excess is reported once.
    """

    def __init__(self, event: RuleEvent, least: int, most: int | None) -> None:
        self._event, self._least, self._most, self._count = event, least, most, 0

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Count a frame."""
        self.judged = True
        if not self._event.matches(record, decoded):
            return None
        self._count, self.came = self._count + 1, True
        if self._most is None or self._count != self._most + 1:
            return None
        came = f"{self._event.text} came {counted(self._count, 'time')}"
        return f"{came}, at most {self._most} is right"

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Report too few frames."""
        if self._count < self._least:
            came = f"{self._event.text} came {counted(self._count, 'time')}"
            yield f"{came}, at least {self._least} is right"


class Rate(RuleDemand):
    """A limit of the number of frames in any span of time of a given length.

    Args:
        event: frames to count.
        most: largest allowed number, up to `MOST_COUNTED`.
        span_us: length of the span of time.
    """

    timed = True

    def __init__(self, event: RuleEvent, most: int, span_us: int) -> None:
        self._event, self._most, self._span_us = event, most, span_us
        self._times_us: deque[int] = deque(maxlen=most + 1)

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Report a frame that exceeds the limit. After a report, the count restarts."""
        self.judged = True
        if not self._event.matches(record, decoded):
            return None
        times_us = self._times_us
        times_us.append(record.at_us)
        took_us = record.at_us - times_us[0]
        if len(times_us) <= self._most or took_us >= self._span_us:
            return None
        came = f"{self._event.text} came {counted(len(times_us), 'time')} in {ms_text(took_us)} ms"
        times_us.clear()
        return f"{came}, at most {self._most} in {ms_text(self._span_us)} is right"


# Demands on the form of frames: their length, the toggle bit of guarding.

_LENGTHS: Final = {
    "nmt": (2,),
    "sync": (0, 1),
    "time": (6,),
    "emcy": (8,),
    "sdo": (8,),
    "boot-up": (1,),
    "heartbeat": (1,),
    "guard": (1,),
    "lss": (8,),
}
"""Number of bytes of data frames by kind (CiA 301, CiA 305)."""


_NodeOnBus = tuple[str, int | None]
"""A bus, and a node on this bus."""


class Dlc(RuleDemand):
    """Demand that frames have the length that CiA 301 or the mapping of a PDO defines.

    Remote frames, and PDOs with an unknown mapping, are not judged.

    Args:
        event: frames to judge.
    """

    def __init__(self, event: RuleEvent) -> None:
        self._matches = event.matches
        self.doubt = f"no frame of {event.text} came whose length is known"

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the length of a frame."""
        frame = record.frame
        if not isinstance(frame, CanFrame) or frame.remote:
            return None
        size = decoded.size
        right = _LENGTHS.get(decoded.kind, ()) if size is None else (size,)
        length = len(frame.data)
        if not right or (length in right and self.judged) or not self._matches(record, decoded):
            return None
        self.judged = True
        if length in right:
            return None
        node = "" if decoded.node is None else f" of node {decoded.node}"
        wanted, why = " or ".join(map(str, right)), "" if size is None else " by its mapping"
        return f"{decoded.kind}{node} has {length} B, {wanted} is right{why}"


_UNASKED: Final = 2
"""Number of heartbeats without a request, after which the node is a producer of heartbeats."""


@dataclass(slots=True)
class _Guarding:
    """The state of node guarding of a node.

    Attributes:
        last: toggle bit of the latest answer, or None before the first answer.
        requested: whether a request has no answer yet, or None before the first request.
    """

    last: int | None = None
    requested: bool | None = None


class Toggle(RuleDemand):
    """Demand that the toggle bit of node guarding changes with each answer.

    The toggle bit is 0 after a boot-up.

    An answer is a frame after a request. If a log has no requests, all frames after a frame with
    the toggle bit set count as answers. A node that produces heartbeats sends no answers.

    Args:
        event: answers, including answers of a node that was guarded before.
    """

    def __init__(self, event: RuleEvent) -> None:
        self._matches = event.matches
        self._nodes: dict[_NodeOnBus, _Guarding] = {}
        self._unasked: Counter[_NodeOnBus] = Counter()
        self.doubt = f"no two answers of {event.text} to guarding came"

    def begin(self, at_us: int) -> None:
        """Clear the states of all nodes."""
        self._nodes.clear()
        self._unasked.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the toggle bit with the previous one."""
        frame, key = record.frame, (record.channel, decoded.node)
        if decoded.kind == "boot-up":
            self._boot(key)
        if decoded.kind not in ("guard", "heartbeat") or not isinstance(frame, CanFrame):
            return None
        if key not in self._nodes and self._matches(record, decoded):
            self._nodes[key] = _Guarding()
        node = self._nodes.get(key)
        if frame.remote:
            if node is not None:
                node.requested = True
        elif len(frame.data) == 1 and self._is_answer(key, node, frame.data[0] >> 7):
            return self._compare(self._nodes[key], frame.data[0] >> 7, decoded)
        return None

    def _boot(self, key: _NodeOnBus) -> None:
        self._unasked[key] = 0
        if key in self._nodes:
            requested = None if self._nodes[key].requested is None else False
            self._nodes[key] = _Guarding(1, requested)

    def _is_answer(self, key: _NodeOnBus, node: _Guarding | None, toggle: int) -> bool:
        """Return whether a frame with this toggle bit answers a request.

        The request is then settled.
        """
        requested = False if node is None else node.requested
        if node is not None and requested:
            node.requested = False
        if toggle:
            self._unasked[key] = 0
        elif requested is False:
            self._unasked[key] += 1
        return node is not None and (
            bool(toggle) or requested is None or (requested and self._unasked[key] < _UNASKED)
        )

    def _compare(self, node: _Guarding, toggle: int, decoded: Decoded) -> str | None:
        last, node.last = node.last, toggle
        self.judged |= last is not None
        return f"{_said(decoded)}: toggle {1 - toggle} is right" if toggle == last else None


# Demands on the time of frames.


class Every(RuleDemand):
    """Limits of the time between two frames of an identifier.

    The first frame after a boot-up may be late.

    Args:
        event: frames to judge.
        low_us: shortest time from the previous frame.
        high_us: longest time from the previous frame, or None for no limit.
    """

    timed = True

    def __init__(self, event: RuleEvent, low_us: int, high_us: int | None) -> None:
        self._event, self._low_us, self._high_us = event, low_us, high_us
        self.doubt = f"{event.text} did not come twice from one sender while it was in force"
        self._last: dict[_Sender, tuple[int, int | None]] = {}

    def begin(self, at_us: int) -> None:
        """Measure the time from the next frame."""
        self._last.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the time since the previous frame."""
        if decoded.kind == "boot-up":
            self._forget(record.channel, decoded.node)
        if not self._event.matches(record, decoded):
            return None
        self.came = True
        sender = _sender_of(record)
        before = self._last.get(sender)
        self._last[sender] = record.at_us, decoded.node
        if before is None:
            return None
        self.judged = True
        gap_us = max(0, record.at_us - before[0])
        return self._wrong(gap_us, decoded.node, "after the one before")

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Report that the frames stopped or never arrived."""
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


class FirstWithin(RuleDemand):
    """Demand that a frame arrives within a time after the traffic, or the rule's scope, begins.

    Args:
        event: frame that must arrive.
        most_us: longest time until the frame.
    """

    timed = True

    def __init__(self, event: RuleEvent, most_us: int) -> None:
        self._event, self._most_us, self.due_us = event, most_us, NEVER
        self.doubt = f"it ends before {ms_text(most_us)} ms have passed, without {event.text}"

    def begin(self, at_us: int) -> None:
        """Wait for the frame."""
        self.due_us = at_us + self._most_us

    def pause(self) -> None:
        """Stop waiting for frames."""
        self.due_us = NEVER

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Check whether the frame has arrived."""
        if self.due_us != NEVER and self._event.matches(record, decoded):
            self.due_us, self.judged = NEVER, True
        return None

    def expire(self) -> Iterable[RuleBreach]:
        """Report that the frame has not arrived."""
        due_us, self.due_us, self.judged = self.due_us, NEVER, True
        yield RuleBreach(due_us, f"no {self._event.text} in {ms_text(self._most_us)} ms")


_Pair = tuple[str, int | None]
"""A bus, and a node if the node relates the events."""


class _DeadlineDemand(RuleDemand):
    """Demand for a reaction within a time after each frame that requires it.

    Args:
        most_us: longest time until the reaction.
    """

    timed = True

    def __init__(self, most_us: int) -> None:
        self._most_us, self.due_us = most_us, NEVER
        self._open: dict[_Pair, tuple[Record, str]] = {}

    def begin(self, at_us: int) -> None:
        """Begin without an open deadline."""
        self.pause()

    def pause(self) -> None:
        """Stop waiting for frames."""
        self._open.clear()
        self.due_us = NEVER

    def expire(self) -> Iterable[RuleBreach]:
        """Report frames that have not arrived."""
        due_us, self.judged = self.due_us, True
        late = [pair for pair, (record, _) in self._open.items() if self._due(record) <= due_us]
        for pair in late:
            record, text = self._open[pair]
            self._close(pair)
            yield RuleBreach(due_us, f"{text} in {ms_text(self._most_us)} ms", record)

    def _await(self, pair: _Pair, record: Record, text: str) -> None:
        if pair not in self._open:
            self._open[pair] = record, text
            self.due_us = min(self.due_us, self._due(record))

    def _close(self, pair: _Pair) -> None:
        if self._open.pop(pair, None) is not None:
            self.judged = True
            dues = (self._due(record) for record, _ in self._open.values())
            self.due_us = min(dues, default=NEVER)

    def _due(self, record: Record) -> int:
        return record.at_us + self._most_us


class Latency(_DeadlineDemand):
    """Demand that a second event follows a first event within a time.

    If the first event occurs again before the second one, time counts from its earlier occurrence.
    If the events name no node, both must come from frames of the same node.

    Args:
        first: event that starts the time.
        second: event that must follow.
        most_us: longest time between them.
    """

    def __init__(self, first: RuleEvent, second: RuleEvent, most_us: int) -> None:
        super().__init__(most_us)
        self._first, self._second = first, second
        self._by_node = not (first.has_node or second.has_node)
        self.doubt = f"no {first.text} came that has {ms_text(most_us)} ms behind it"

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """End the deadlines that the frame meets, then start new ones."""
        node = decoded.node if self._by_node else None
        if self._second.matches(record, decoded):
            self._close((record.channel, node))
            self._close((record.channel, None))
        if self._first.matches(record, decoded):
            self._await((record.channel, node), record, f"{_said(decoded)}: no {self._second.text}")
        return None


class Answered(_DeadlineDemand):
    """Demand for an answer within a time after a request of an SDO client or a guarding master.

    For a repeated request, time counts from the first one.

    Args:
        event: requests of clients and masters.
        most_us: longest time until the answer.
    """

    def __init__(self, event: RuleEvent, most_us: int) -> None:
        super().__init__(most_us)
        self._event = event
        self.doubt = f"no request of {event.text} came that has {ms_text(most_us)} ms behind it"

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """End the deadlines of requests that are answered or replaced, then start new ones."""
        is_sdo = decoded.kind == "sdo"
        if not (is_sdo or decoded.kind in ("guard", "heartbeat", "boot-up")):
            return None
        pair = f"{record.channel} {'sdo' if is_sdo else 'guard'}", decoded.node
        left = any(one.outcome is TransferOutcome.UNANSWERED for one in decoded.transfers)
        before = self._open.get(pair) if left else None
        if left or not decoded.asks:
            self._close(pair)
        if decoded.asks and self._event.matches(record, decoded):
            self._await(pair, record, f"{_said(decoded)}: not answered")
        return f"{before[1]} before the next request" if before else None


# Demands on the values of signals.

_EMCY: Final = "emcy"


class In(RuleDemand):
    """Demand that a value is one of the valid values.

    For a signal, a violation is reported when it starts. For other events, it is reported for each
    frame. An EMCY with code 0000h clears an error, and is valid.

    Args:
        event: signal, or kind of frames. For a kind of frames, the first value counts.
        values: text of the set of valid values in the rule.
        holds: function that returns whether a signal has one of the values.
    """

    def __init__(self, event: RuleEvent, values: str, holds: Callable[[Signal], bool]) -> None:
        self._event, self._value_of, self._once = event, event.value_of(), event.is_signal
        self._values, self._holds = values, holds
        self.doubt = f"no value of {event.text} came while it was in force"
        self._wrong: set[_Sender] = set()

    def pause(self) -> None:
        """Allow the violation to be reported again."""
        self._wrong.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the value with the valid values."""
        signal = self._value_of(record, decoded)
        if signal is None:
            return None
        self.judged = True
        sender = _sender_of(record)
        if self._holds(signal) or (decoded.kind == _EMCY and not signal.value):
            self._wrong.discard(sender)
            return None
        if self._once and sender in self._wrong:
            return None
        self._wrong.add(sender)
        return f"{_said(decoded)}; {self._event.text} in {self._values} is right"


class Follow(RuleDemand):
    """Base class of demands that compare a value with the previous one of the same identifier.

    Args:
        event: signal, or kind of frames, as in `In`.
    """

    def __init__(self, event: RuleEvent) -> None:
        self._value_of = event.value_of()
        self._last: dict[_Sender, tuple[float, int | None]] = {}
        self.doubt = f"no two values of {event.text} came from one sender while it was in force"

    def begin(self, at_us: int) -> None:
        """Clear the previous values."""
        self._last.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the value. A boot-up restarts the comparison."""
        if decoded.kind == "boot-up":
            self._last = {
                sender: last
                for sender, last in self._last.items()
                if (sender[0], last[1]) != (record.channel, decoded.node)
            }
        signal = self._value_of(record, decoded)
        if signal is None or not isinstance(signal.value, int | float):
            return None
        sender = _sender_of(record)
        before = self._last.get(sender)
        self._last[sender] = signal.value, decoded.node
        self.judged |= before is not None
        return None if before is None else self._compare(sender, before[0], signal)

    def _compare(self, sender: _Sender, before: float, signal: Signal) -> str | None:
        raise NotImplementedError


class Counts(Follow):
    """Demand that a counter increases by one. From its highest value, it continues with 0 or 1."""

    def __init__(self, event: RuleEvent) -> None:
        super().__init__(event)
        self._highest: dict[_Sender, float] = {}

    def _compare(self, sender: _Sender, before: float, signal: Signal) -> str | None:
        value = signal.value
        assert isinstance(value, int | float)
        highest = self._highest[sender] = max(before, self._highest.get(sender, before))
        if value == before + 1 or (value in (0, 1) and before == highest):
            return None
        return f"{signal.name} is {value:g} after {before:g}, one more is right"


class Steps(Follow):
    """A limit of the change of a value from one frame to the next.

    Args:
        event: signal, or kind of frames, as in `In`.
        most: largest allowed change.
    """

    def __init__(self, event: RuleEvent, most: float) -> None:
        super().__init__(event)
        self._most = most

    def _compare(self, sender: _Sender, before: float, signal: Signal) -> str | None:
        value = signal.value
        assert isinstance(value, int | float)
        if abs(value - before) <= self._most:
            return None
        return f"{signal.name} is {value:g} after {before:g}, a step of {self._most:g} is right"


class Changes(RuleDemand):
    """Demand that a value changes within a time. A violation is reported once.

    Args:
        event: signal, or kind of frames, as in `In`.
        most_us: longest time without a change.
    """

    timed = True

    def __init__(self, event: RuleEvent, most_us: int) -> None:
        self._value_of, self._most_us = event.value_of(), most_us
        self.doubt = f"no two values of {event.text} came from one sender while it was in force"
        self._since: dict[_Sender, tuple[object, int, bool]] = {}

    def begin(self, at_us: int) -> None:
        """Clear the previous values."""
        self._since.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the value with the previous value."""
        signal = self._value_of(record, decoded)
        if signal is None:
            return None
        sender, at_us = _sender_of(record), record.at_us
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
