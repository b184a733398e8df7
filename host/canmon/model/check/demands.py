"""Demands on the frequency, form, time and values of frames."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal, TransferOutcome
from tickrig.host.canmon.model.decode.filter import Test, signal_place, signal_reader
from tickrig.host.canmon.model.frames import ERROR, AnyRecord, Record, any_ident, ms_text
from tickrig.host.text.values import counted
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.canopen import nmt
from tickrig.wire.instant import NEVER

# The events of a rule.

_Sender = tuple[str, int]
"""A bus, and an identifier on this bus."""


def _sender_of(record: Record) -> _Sender:
    """Return the sender of a frame. All error frames have the same sender."""
    frame = record.frame
    return record.channel, ERROR if isinstance(frame, ErrorFrame) else any_ident(frame)


_EVENT_SIGNALS: Final = frozenset(["code", "register", "command", "class", "days", "ms"])
"""Signals of EMCY, NMT, LSS, TIME and error frames.

Their names are known even if none of these frames came.
"""
_EVENT_KINDS: Final = frozenset(["emcy", "nmt", "lss", "time", "error"])
"""Kinds of frames of which each is an event of its own, although it has the same values again."""


class AtFrames:
    """Test of signals at the frames that other tests select, as in `tpdo1 and 3.statusword.fault`.

    If a selected frame does not contain one of the signals, the latest value of this signal on the
    bus is used. For the signals in `_EVENT_SIGNALS`, earlier values are never used. To know the
    latest values, the test must receive all frames of the bus.

    Args:
        frames: tests that select the frames.
        states: tests of signals, each with the names of its signals.
        each: True if the tests in `frames` select a kind of frames, such as `tpdo1`. False if they
            select only a sender, such as `node 3`. If False, earlier values are never used, so a
            frame must contain the signals itself.
    """

    def __init__(
        self, frames: Iterable[Test], states: Iterable[tuple[Test, Collection[str]]], *, each: bool
    ) -> None:
        self._frames, self.each = tuple(frames), each
        self._states = [_SignalState(test, paths, kept=each) for test, paths in states]
        self._kept = [state for state in self._states if state.kept]

    @staticmethod
    def is_event_signal(path: str) -> bool:
        """Return whether a signal is one of `_EVENT_SIGNALS`, or a bit of it.

        >>> is_known = AtFrames.is_event_signal
        >>> is_known("5.code"), is_known("register.2"), is_known("speed")
        (True, True, False)
        """
        name, _, bit = signal_place(path)[1].partition(".")
        return name in _EVENT_SIGNALS and (not bit or bit.isdecimal())

    def select(self, *tests: Test) -> None:
        """Restrict the selected frames to those that pass more tests."""
        self._frames += tests

    def __call__(self, record: AnyRecord, decoded: Decoded) -> bool:
        """Return whether a frame is selected and the tests of signals hold at it."""
        return self.state(record, decoded) is True

    def state(self, record: AnyRecord, decoded: Decoded) -> bool | None:
        """Return whether a frame is selected and all signals pass their tests at this frame.

        The result is None if the frame is not selected, or if the value of a signal is unknown.
        """
        for state in self._kept:
            state.take(record, decoded)
        for test in self._frames:
            if not test(record, decoded):
                return None
        if not isinstance(record, Record):
            return None
        states = [state.at(record, decoded) for state in self._states]
        return None if None in states else all(states)


class _SignalState:
    """The latest result of a test of signals on each bus, and of each node on it.

    Args:
        test: test of signals.
        paths: names of the signals.
        kept: whether a result counts until the next one, or only for its own frame.
    """

    def __init__(self, test: Test, paths: Collection[str], *, kept: bool) -> None:
        places = [signal_place(path) for path in paths]
        self._test, self._finders = test, [signal_reader(path) for path in paths]
        self.kept = kept and not any(map(AtFrames.is_event_signal, paths))
        self._own = any(node is None and " " not in name for node, name, _ in places)
        self._latest: dict[tuple[str, int | None], tuple[bool, _Sender]] = {}

    def take(self, record: AnyRecord, decoded: Decoded) -> None:
        """Keep the result of the test at a frame that contains a signal."""
        for find in self._finders:
            if find(decoded) is not None and isinstance(record, Record):
                latest = self._test(record, decoded), _sender_of(record)
                channel = record.channel
                self._latest[channel, None] = self._latest[channel, decoded.node] = latest
                return

    def at(self, record: Record, decoded: Decoded) -> bool | None:
        """Return whether the signals pass the test when a frame arrives, or None if unknown.

        If the frame contains none of the signals, the result of the latest frame that contains one
        is used.
        """
        if any(find(decoded) is not None for find in self._finders):
            return self._test(record, decoded)
        latest = self._latest.get((record.channel, decoded.node if self._own else None))
        if latest is None or latest[1] == _sender_of(record):  # a frame that is cut short
            return None
        return latest[0]


@dataclass(frozen=True, slots=True)
class RuleEvent:
    """The event in a rule: a filter, and each frame that passes it is an occurrence of the event.

    Attributes:
        text: text of the filter as written in the rule.
        matches: function that returns whether a frame passes the filter.
        paths: names of the signals in the filter.
        is_signal: whether the filter is only the name of a signal, without a comparison.
        has_node: whether the filter contains a node-ID.
        at_frames: test of the part of the filter that selects frames, as in `emcy and code = 0`, or
            None if the filter consists of signals, or of parts joined by `or`.
        alone: test of the parts without signals, in a filter that joins them with signals by `or`,
            as in `emcy or statusword.fault`, otherwise None.
        is_id: whether the filter consists only of CAN-IDs.
    """

    text: str
    matches: Test
    paths: tuple[str, ...] = ()
    is_signal: bool = False
    has_node: bool = False
    at_frames: AtFrames | None = None
    alone: Test | None = None
    is_id: bool = False

    def carriers(self) -> Callable[[Decoded], bool]:
        """Return a function that returns whether a frame contains one of the named signals."""
        finders = [signal_reader(path) for path in self.paths]
        return lambda decoded: any(find(decoded) is not None for find in finders)

    def value_of(self) -> Callable[[Record, Decoded], Signal | None]:
        """Return a function that finds the signal of this event in a frame.

        If `is_signal` is true, the function returns the signal that `paths` names. Otherwise it
        returns the first signal of each frame that passes the filter. If the frame has no such
        signal, the function returns None.
        """
        matches = self.matches
        if self.is_signal:
            finders = [signal_reader(path) for path in self.paths]
            return lambda record, decoded: next(filter(None, (f(decoded) for f in finders)), None)
        return lambda record, decoded: (
            decoded.signals[0] if decoded.signals and matches(record, decoded) else None
        )


EVERY: Final = RuleEvent("all frames", lambda record, decoded: True)


def _said(decoded: Decoded) -> str:
    """Return the meaning of a frame as text for a finding."""
    node = "" if decoded.node is None else f" of node {decoded.node}"
    return f"{decoded.kind}{node}: {decoded.text}".removesuffix(": ")


# Demands on frames, which apply in the scope of their rule.


class RuleBreach(NamedTuple):
    """A violation of a rule that is detected because a deadline has passed, not because of a frame.

    Attributes:
        at_us: time in microseconds at which the violation was detected.
        text: description of the violation.
        record: frame that shows the violation, such as the unanswered request, or None if no frame
            does.
    """

    at_us: int
    text: str
    record: Record | None = None


class RuleDemand:
    """Base class of the demands of rules, such as `every 10ms` in the rule `181 every 10ms`.

    This class itself demands nothing. Its memory grows at most with the number of CAN-IDs.

    Attributes:
        due_us: time in microseconds by which a frame must arrive, or `NEVER`. After this time,
            `expire` reports the violation.
        came: whether a frame that the demand counts has arrived. The value stays False if the
            demand counts no frames.
        judged: whether at least one frame was judged, so that the rule can count as passed.
        timed: whether the demand is about time. Such a demand judges nothing if all frames have the
            same time.
        doubt: reason that is reported if nothing was judged.
        forbids: whether the demand forbids what the rule names, so that it need not occur.
    """

    due_us: int = NEVER
    came: bool = False
    judged: bool = False
    timed: bool = False
    doubt: str = "no frame came while it was in force"
    forbids: bool = False

    def begin(self, at_us: int) -> None:
        """Start, also after a pause."""

    def pause(self) -> None:
        """Stop the demand until `begin`."""

    def watch(self, record: Record, decoded: Decoded) -> None:
        """Process a frame that is not judged, because the rule does not apply now."""

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Return the violation in a frame."""
        return None

    def expire(self) -> Iterable[RuleBreach]:
        """Report once that a frame has not arrived by `due_us`."""
        return ()

    def end(self, end_us: int, running: bool) -> Iterable[str]:
        """Yield a description of each violation that is known only at the end of the traffic.

        An example is a frame that never arrived.

        Args:
            end_us: end of the traffic in microseconds, or the current time if the traffic
                continues.
            running: whether the scope of the rule is active at this time, so that the rule applies.
        """
        return ()


# Demands on the frequency of frames.

MOST_COUNTED: Final = 10_000
"""Largest number of frames that a rule may allow in a span, because their times are kept."""


class Truth(RuleDemand):
    """Demand that a condition on signals is always true, or that it is never true.

    A violation is reported when it begins. As long as the violation lasts, it is not reported
    again. Only for two kinds of frames, each frame that violates the demand is reported:

    - EMCY, NMT, LSS, TIME and error frames.
    - Frames of a kind that the condition names, if they do not contain the signals of the
      condition. For example, `tpdo1 of 3 and node 3 stopped` names a TPDO, and this TPDO does not
      contain the NMT state.

    Args:
        event: condition on signals, such as `position > 100`.
        wanted: True if the condition must always be true, False if it must never be true.
    """

    def __init__(self, event: RuleEvent, wanted: bool) -> None:
        self._matches, self._carries, self._wanted = event.matches, event.carriers(), wanted
        self._at_frames, self._wrong = event.at_frames, set[_Sender]()
        self._each = self._at_frames is not None and self._at_frames.each
        self._alone = None if wanted else event.alone
        self.forbids = not wanted
        # without the event, too, it is judged: misspelt signals are reported by the rule
        forbids_frames = not wanted and (self._each or event.alone is not None)
        self._proves = forbids_frames or all(map(AtFrames.is_event_signal, event.paths))
        self.doubt = f"nothing with {event.text} came while it was in force"

    def pause(self) -> None:
        """Allow the violation to be reported again."""
        self._wrong.clear()

    def watch(self, record: Record, decoded: Decoded) -> None:
        """Keep the values of signals for the time when the demand applies again."""
        if self._at_frames is not None:
            self._at_frames.state(record, decoded)

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the condition with its required value."""
        if self._proves:
            self.judged = True
        if self._alone is not None and self._alone(record, decoded):
            self.judged = True
            return _said(decoded)
        if self._at_frames is not None:
            holds = self._at_frames.state(record, decoded)
        else:
            holds = self._matches(record, decoded) if self._carries(decoded) else None
        if holds is None:
            return None
        self.judged = True
        sender = _sender_of(record)
        if holds is self._wanted:
            self._wrong.discard(sender)
        elif sender not in self._wrong or self._is_event(decoded):
            self._wrong.add(sender)
            return _said(decoded)
        return None

    def _is_event(self, decoded: Decoded) -> bool:
        """Return whether a frame is reported again, which is not a sample of the condition."""
        return decoded.kind in _EVENT_KINDS or (self._each and not self._carries(decoded))


class Never(RuleDemand):
    """Demand that certain frames never arrive. Each of these frames is reported as a violation.

    Args:
        event: event that selects the forbidden frames.
    """

    forbids = True

    def __init__(self, event: RuleEvent) -> None:
        self._matches = event.matches

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Report the frame as a violation."""
        self.judged = True
        return _said(decoded) if self._matches(record, decoded) else None


class Count(RuleDemand):
    """Demand that limits how many frames match an event in total.

    Args:
        event: event that selects the frames to count.
        least: smallest allowed number of frames. If fewer arrive, this is reported at the end.
        most: largest allowed number of frames, or None for no limit. Only the first frame above the
            limit is reported.
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
    """Demand that limits how many frames match an event within any period of a given length.

    Args:
        event: event that selects the frames to count.
        most: largest allowed number of frames in the period, up to `MOST_COUNTED`.
        span_us: length of the period in microseconds.
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
    """Demand that frames have the right number of data bytes.

    The right number comes from CiA 301 or from the mapping of a PDO. Remote frames, and PDOs whose
    mapping is unknown, are not judged.

    Args:
        event: event that selects the frames to judge.
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
    """Demand that the toggle bit changes with each answer to a node guarding request.

    The toggle bit must be 0 in the first answer after a boot-up.

    If the log contains requests, the first frame after a request is the answer. If the log contains
    no requests, only the toggle bit shows that a frame is an answer, because the toggle bit of a
    heartbeat is always 0. Therefore the first frame with a set toggle bit and all later frames are
    judged as answers. A node that produces heartbeats is not judged, because it does not answer
    guarding requests.

    Args:
        event: event that selects the nodes to judge. A node stays selected after its first matching
            frame.
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


_RESTARTS: Final = ("boot-up", "nmt")


class Every(RuleDemand):
    """Demand that limits the time between two successive frames of the same CAN-ID.

    If the event names only CAN-IDs, the time between each two successive frames is judged. For
    other events, a boot-up of the node interrupts the sequence:

    - The time from the last frame to the boot-up is compared with `high_us` only. If an NMT command
      has reset the node, this time is not judged.
    - The time from the boot-up to the next frame is not judged.

    Args:
        event: event that selects the frames to judge.
        low_us: shortest allowed time between two frames in microseconds.
        high_us: longest allowed time between two frames in microseconds, or None for no limit.
    """

    timed = True

    def __init__(self, event: RuleEvent, low_us: int, high_us: int | None) -> None:
        self._event, self._low_us, self._high_us = event, low_us, high_us
        self.doubt = f"{event.text} did not come twice from one sender while it was in force"
        self._last: dict[_Sender, tuple[int, int | None]] = {}
        self._reset: set[_Sender] = set()  # nodes that an NMT command has reset, by bus

    def begin(self, at_us: int) -> None:
        """Measure the time from the next frame."""
        self._last.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the time since the previous frame."""
        said = None
        if decoded.kind in _RESTARTS and not self._event.is_id:
            said = self._restart(record, decoded)
        if not self._event.matches(record, decoded):
            return said
        self.came = True
        sender = _sender_of(record)
        before = self._last.get(sender)
        self._last[sender] = record.at_us, decoded.node
        if before is None:
            return said
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

    def _restart(self, record: Record, decoded: Decoded) -> str | None:
        """Process an NMT command or a boot-up. A boot-up without a reset ends a silence."""
        channel, node = record.channel, decoded.node
        if decoded.kind == "nmt":
            if decoded.signals and decoded.signals[0].value in nmt.RESETS:
                nodes = range(1, 0x80) if node is None else (node,)
                self._reset |= {(channel, one) for one in nodes}
            return None
        last = self._last.items()
        ended = [one for key, one in last if (key[0], one[1]) == (channel, node)]
        self._last = {key: one for key, one in last if (key[0], one[1]) != (channel, node)}
        if node is None or (channel, node) in self._reset:
            self._reset.discard((channel, node or 0))
            return None
        self.judged |= bool(ended) and self._high_us is not None
        silent_us = [record.at_us - at_us for at_us, _ in ended]
        late = [us for us in silent_us if self._high_us is not None and us > self._high_us]
        said = (self._wrong(us, node, "without another before the boot-up") for us in late)
        return "; ".join(filter(None, said)) or None

    def _wrong(self, gap_us: int, node: int | None, how: str) -> str | None:
        high_us = self._high_us
        if self._low_us <= gap_us and (high_us is None or gap_us <= high_us):
            return None
        right = f"{ms_text(self._low_us)} to {ms_text(high_us)}" if high_us is not None else ""
        right = right or f"at least {ms_text(self._low_us)}"
        whose = "" if node is None else f"node {node}: "
        return f"{whose}{ms_text(gap_us)} ms {how}, {right} is right"


class FirstWithin(RuleDemand):
    """Demand that a frame which matches an event arrives within a given time.

    The time counts from the beginning of the traffic, or from the moment when the rule begins to
    apply.

    Args:
        event: event that selects the frame that must arrive.
        most_us: longest allowed time until the frame, in microseconds.
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
    """Demand that a second event follows a first event within a given time.

    If the first event occurs again before the second event, the time still counts from its first
    occurrence. If neither event names a node, both events must come from the same node.

    Args:
        first: event that starts the time.
        second: event that must follow.
        most_us: longest allowed time between the events, in microseconds.
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
    """Demand that each SDO request and each node guarding request is answered within a given time.

    If a client or master repeats a request, the time counts from the first request.

    Args:
        event: event that selects the requests.
        most_us: longest allowed time until the answer, in microseconds.
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
    """Demand that a value belongs to a set of valid values.

    If the event is the name of a signal, the first invalid value is reported, and then none until
    the signal was valid again. For events that select frames, and for signals in EMCY, NMT, LSS,
    TIME and error frames, each invalid value is reported. An EMCY with error code 0000h is always
    valid, because it reports that an error is gone.

    Args:
        event: name of a signal, or event that selects frames. If it selects frames, the first
            signal in each selected frame is judged.
        values: set of valid values as written in the rule, used in messages.
        holds: function that returns whether the value of a signal is valid.
    """

    def __init__(self, event: RuleEvent, values: str, holds: Callable[[Signal], bool]) -> None:
        self._event, self._value_of, self._once = event, event.value_of(), event.is_signal
        self._values, self._holds = values, holds
        self.doubt = f"no value of {event.text} came while it was in force"
        self._wrong: set[_Sender] = set()
        self._proves = self._once and all(map(AtFrames.is_event_signal, event.paths))

    def pause(self) -> None:
        """Allow the violation to be reported again."""
        self._wrong.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the value with the valid values."""
        self.judged |= self._proves
        signal = self._value_of(record, decoded)
        if signal is None:
            return None
        self.judged = True
        sender = _sender_of(record)
        if self._holds(signal) or (decoded.kind == _EMCY and not signal.value):
            self._wrong.discard(sender)
            return None
        if self._once and sender in self._wrong and decoded.kind not in _EVENT_KINDS:
            return None
        self._wrong.add(sender)
        return f"{_said(decoded)}; {self._event.text} in {self._values} is right"


class Follow(RuleDemand):
    """Base class of demands that compare each value with the previous value from the same CAN-ID.

    Args:
        event: event of the rule. If it is only the name of a signal, the values of this signal are
            compared. Otherwise it is a filter of frames, and the value of the first signal in each
            frame that passes is compared.
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
    """Demand that a counter in a frame increases by one from frame to frame.

    After its highest value, the counter must restart at 0 or 1.
    """

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
    """Demand that limits how much a value may change from one frame to the next.

    Args:
        event: event of the rule. If it is only the name of a signal, the values of this signal are
            used. Otherwise the event selects frames. In each selected frame, the value of the first
            signal is used.
        most: largest allowed change of the value.
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
    """Demand that a value changes at least once within a given time.

    If a value stays constant for longer, this is reported once. After the next change of the value,
    it can be reported again.

    Args:
        event: event of the rule. If it is only the name of a signal, the values of this signal are
            used. Otherwise the event selects frames. In each selected frame, the value of the first
            signal is used.
        most_us: longest allowed time without a change, in microseconds.
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
