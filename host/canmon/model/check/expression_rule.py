"""A rule that was written as an expression, held against decoded frames one by one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

from tickrig.host.canmon.model.check.demands import RuleDemand, RuleEvent
from tickrig.host.canmon.model.check.rule import ONE_TIME, CheckedTraffic, TrafficFinding
from tickrig.host.canmon.model.decode import filter_terms
from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.filter import FilterParser
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.signal_spec import EXTENDED, FrameSlice, parse_slice
from tickrig.host.text.names import closest
from tickrig.wire.can import ErrorFrame

# When a rule is in force: after something, before it, or while a condition holds.


class RuleScope:
    """Says whether a rule is in force.

    Attributes:
        text: as it is written.
    """

    text = ""

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Take each frame; say whether it is judged."""
        raise NotImplementedError


class After(RuleScope):
    """From the first frame after an event on."""

    def __init__(self, event: RuleEvent) -> None:
        self._event, self._came, self.text = event, False, f"after {event.text}"

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Hold once it came; the event itself is not judged."""
        came = self._came
        if not came:
            self._came = self._event.matches(record, decoded)
        return came


class Before(RuleScope):
    """Until an event."""

    def __init__(self, event: RuleEvent) -> None:
        self._event, self._came, self.text = event, False, f"before {event.text}"

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Hold until it comes; the event itself is not judged."""
        if not self._came:
            self._came = self._event.matches(record, decoded)
        return not self._came


class While(RuleScope):
    """While a condition on signals holds, by the latest frame of the bus that carries one."""

    def __init__(self, event: RuleEvent) -> None:
        self._event, self._carries, self.text = event, event.carriers(), f"while {event.text}"
        self._true: dict[str, bool] = {}

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Hold from the frame on that makes it true."""
        if self._carries(decoded):
            self._true[record.channel] = self._event.matches(record, decoded)
        return self._true.get(record.channel, False)


# Bits of frames in rules, as `canmon graph` names them: `181[2:6]s*0.001`, `181[0.3]`.
#
# A slice is a signal of its frames, whatever else they mean.

_CAN_ID: Final = re.compile(r"[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}")
_TYPE: Final = re.compile(r"[usfb*/+-]\S*")

Slice = tuple[str, FrameSlice]
"""Bits of a frame, under the name by which a rule asks for them."""


class SliceParser(FilterParser):
    """Takes slices where a filter takes signals.

    Args:
        text: the rule.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._slices: dict[str, FrameSlice] = {}

    def _plain_term(self) -> filter_terms.Test:
        if not self._is_slice():
            return super()._plain_term()
        name = self._slice()
        self._signals.add(name)
        if self._next.text not in filter_terms.COMPARISONS:
            return filter_terms.signal_test(name)
        sign, value = self._comparison(name)
        if filter_terms.number(value) is None:
            raise self._error(f"{value!r} is no number")
        del self._tokens[0]
        return filter_terms.signal_test(name, sign, value)

    def _is_slice(self) -> bool:
        word, column = self._next
        is_id = _CAN_ID.fullmatch(word) is not None
        return is_id and self._tokens[1] == ("[", column + len(word))

    def _slice(self) -> str:
        """Take the words of a slice; return it as it is written."""
        begin = self._next.column - 1
        while self._next.text not in ("]", ""):
            del self._tokens[0]
        end = self._next.column
        self._expect("]")
        if self._next.column == end + 1 and _TYPE.fullmatch(self._next.text):
            end += len(self._tokens.pop(0).text)
        name = self._text[begin:end]
        try:
            self._slices[name] = parse_slice(name)
        except ValueError as reason:
            raise self.wrong(self._text, begin + 1, str(reason)) from None
        return name


def _with_slices(record: Record, decoded: Decoded, slices: Iterable[Slice]) -> Decoded:
    """Return what a frame says, with the slices that are of it."""
    frame = record.frame
    if isinstance(frame, ErrorFrame) or frame.remote:
        return decoded
    key = frame.can_id | EXTENDED if frame.extended else frame.can_id
    values = [(name, cut.value(frame.data)) for name, cut in slices if cut.key == key]
    found = [Signal(name, _plain(value)) for name, value in values if value is not None]
    if not found:
        return decoded
    text = " ".join([decoded.text, *map(str, found)]).strip()
    return decoded._replace(signals=(*decoded.signals, *found), summary=text)


def _plain(value: float) -> float:
    return int(value) if float(value).is_integer() else value


# A rule that was written as an expression, held against decoded frames one by one.

_MOST_NAMES: Final = 1_000
"""So many names of signals are kept, to tell what a misspelt one may mean."""


_UNMAPPED: Final = "unmapped"
_NO_MAPPING: Final = "; PDOs came that nobody mapped: name them by --eds"


class ExpressionRule:
    """One rule, for one node where it was written for several.

    A signal that it names must come: a name may be misspelt, and a rule that judges nothing
    does not hold.

    Args:
        name: as findings and reports have it.
        demand: what must hold.
        scopes: when; always where there are none.
        missing: the signals and words that it names, of which none has come yet.
        slices: those of them that are bits of frames.
        mapped: it speaks of what PDOs carry, or of PDOs by their numbers.
    """

    def __init__(  # noqa: PLR0913 - what a rule is made of
        self,
        name: str,
        demand: RuleDemand,
        scopes: Sequence[RuleScope],
        missing: filter_terms.MissingSignals,
        slices: Sequence[Slice],
        *,
        mapped: bool,
    ) -> None:
        self.name, self._demand, self._scopes = name, demand, tuple(scopes)
        self._slices = tuple(slices)
        self._missing = missing
        self._mapped, self._unmapped = mapped, False
        self._looks, self._names = mapped or bool(self._missing), set[str]()
        self._running, self._began, self._found, self._forced = False, False, False, False

    @property
    def due_us(self) -> int:
        """Until when `advance` has nothing to say."""
        return self._demand.due_us

    def take(self, record: Record, decoded: Decoded) -> TrafficFinding | None:
        """Return how a frame breaks it."""
        if self._slices:
            decoded = _with_slices(record, decoded, self._slices)
        if self._looks:
            self._look(record, decoded)
        # without a scope nothing is asked once it runs: a third of the time of a rule
        if (self._scopes or not self._running) and not self._in_force(record, decoded):
            return None
        text = self._demand.judge(record, decoded)
        if not text:
            return None
        self._found = True
        return TrafficFinding(record.at_us, self.name, text, record)

    def advance(self, now_us: int) -> list[TrafficFinding]:
        """Return what had not come in time before a frame of this time; listening goes on."""
        if now_us <= self.due_us:
            return []
        self._found = True
        return [
            TrafficFinding(fault.at_us, self.name, fault.text, fault.record)
            for fault in self._demand.expire()
        ]

    def end(self, end_us: int) -> list[TrafficFinding]:
        """Return what is missing at a time; nothing is changed by it."""
        texts = list(self._demand.end(end_us, self._running or not self._began))
        if not (texts or self._found):
            texts = [f"no signal {path} came{self._near(path)}" for path in self._missing.paths]
            texts += [f"no frame with {word} came" for word in self._missing.words]
        hint = "" if self._demand.came or not self._unmapped else _NO_MAPPING
        return [TrafficFinding(end_us, self.name, text + hint) for text in texts]

    def unjudged(self, evidence: CheckedTraffic) -> str:
        """Say why it has judged nothing; empty if it has."""
        if not self._forced:
            return f"it was never in force: {' '.join(scope.text for scope in self._scopes)}"
        if self._demand.timed and evidence.untimed:
            return ONE_TIME
        if self._demand.judged:
            return ""
        hint = "" if self._demand.came or not self._unmapped else _NO_MAPPING
        return self._demand.doubt + hint

    def _in_force(self, record: Record, decoded: Decoded) -> bool:
        self._began = True
        held = [scope.holds(record, decoded) for scope in self._scopes]  # each must see it
        running = all(held)
        if running != self._running:
            self._running = running
            if running:
                self._forced = True
                self._demand.begin(record.at_us)
            else:
                self._demand.pause()
        return running

    def _look(self, record: Record, decoded: Decoded) -> None:
        """See which signals come, until all have, and whether PDOs come that nobody mapped."""
        if self._mapped and decoded.kind == _UNMAPPED:
            self._unmapped = True
        self._missing.take(record, decoded)
        self._looks = bool(self._missing) or (self._mapped and not self._unmapped)
        if len(self._names) < _MOST_NAMES:
            self._names.update(signal.name for signal in decoded.signals)

    def _near(self, path: str) -> str:
        _, name, _ = filter_terms.signal_place(path)
        near = closest(name, [*filter_terms.KINDS, *sorted(self._names)])
        return f"; did you mean {near[0]}?" if near and near[0] != name else ""
