"""Rules as text, which consist of an event as for `-F`, a demand on the event, and a scope.

```
rule   = event demand (scope) ...
event  = a filter, see `decode.filter`, with 181[2:4] or 181[0.3] as a signal, see
         `graph.signal_spec`; `dlc` alone is `all frames dlc`
demand = never | always | once | at most 3 [per 1s] | at least 3
       | in {1, 8130h, 5..9, word} | in 1..5 | steps under 5 | counts | changes within 1s
       | every 10ms ±10% | every 9ms..11ms | every 5ms.. | every ..20ms
       | within 2s [after event] | to event under 2ms | answered within 50ms
       | dlc | toggle
scope  = after event | before event | while condition on signals
```

>>> [made.name for made in parse_rule("tpdo1 of 3-4 every 10ms ±10%").make()]
['tpdo1 of 3-4 every 10ms ±10%', 'tpdo1 of 3-4 every 10ms ±10%']
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from tickrig.host.canmon.model.check import demands
from tickrig.host.canmon.model.check.rule import ONE_TIME, CheckedTraffic, TrafficFinding
from tickrig.host.canmon.model.decode import filter as filters
from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.filter import FilterError, FilterParser, Token
from tickrig.host.canmon.model.frames import Record, flagged_id
from tickrig.host.canmon.model.graph.series import FrameSlice, parse_slice
from tickrig.host.text.names import closest
from tickrig.host.text.values import parse_time_us

# A rule written as an expression, checked against decoded frames one by one.


# The scope of a rule: after an event, before an event, or while a condition is true.


class RuleScope:
    """The part of a rule that restricts when the rule applies, such as `after sync`.

    Args:
        word: word before the event: `after`, `before` or `while`.
        event: event that begins or ends the scope, or condition that must be true.

    Attributes:
        text: scope as written in the rule, which is the word and the event.
    """

    def __init__(self, word: str, event: demands.RuleEvent) -> None:
        self._event, self.text = event, f"{word} {event.text}"

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Process a frame. Return whether the rule judges it."""
        raise NotImplementedError


class _After(RuleScope):
    """Scope that begins with the first frame after an event."""

    _came = False

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Return True once the event has occurred. The event itself is not judged."""
        came = self._came
        self._came = came or self._event.matches(record, decoded)
        return came


class _Before(_After):
    """Scope that ends with an event."""

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Return True until the event occurs. The event itself is not judged."""
        self._came = self._came or self._event.matches(record, decoded)
        return not self._came


class _While(RuleScope):
    """Scope in which a condition on signals is true, by the latest frame with such a signal."""

    def __init__(self, word: str, event: demands.RuleEvent) -> None:
        super().__init__(word, event)
        self._carries, self._true = event.carriers(), dict[str, bool]()

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Return True from the frame that makes the condition true."""
        if self._carries(decoded):
            self._true[record.channel] = self._event.matches(record, decoded)
        return self._true.get(record.channel, False)


# Bits of frames in rules, as `canmon graph` names them: `181[2:6]s*0.001`, `181[0.3]`.
#
# A slice is a signal of its frames, whatever else they mean.

_CAN_ID: Final = re.compile(r"[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}")
_TYPE: Final = re.compile(r"[usfb*/+-]\S*")

_Slice = tuple[str, FrameSlice]
"""Bits of a frame, under the name that a rule uses."""


class _SliceParser(FilterParser):
    """Parser that accepts slices of frames in places where a filter has signals.

    Args:
        text: text of the rule.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._slices: dict[str, FrameSlice] = {}

    def _plain_term(self) -> filters.Test:
        if not self._is_slice():
            return super()._plain_term()
        return self._compared(self._slice(), ())

    def _is_slice(self) -> bool:
        word, column = self._next
        is_id = _CAN_ID.fullmatch(word) is not None
        return is_id and self._tokens[1] == ("[", column + len(word))

    def _slice(self) -> str:
        """Read the words of a slice. Return them as written."""
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


def _with_slices(record: Record, decoded: Decoded, slices: Iterable[_Slice]) -> Decoded:
    """Return a decoded frame with the added values of its slices."""
    key, data = flagged_id(record), record.frame.data  # a remote or error frame has other flags
    values = [(name, cut.value(data)) for name, cut in slices if cut.key == key]
    found = [Signal(name, _plain(value)) for name, value in values if value is not None]
    if not found:
        return decoded
    text = " ".join([decoded.text, *map(str, found)]).strip()
    return decoded._replace(signals=(*decoded.signals, *found), summary=text)


def _plain(value: float) -> float:
    return int(value) if float(value).is_integer() else value


# A rule written as an expression, checked against decoded frames one by one.

_MOST_NAMES: Final = 1_000
"""Number of signal names kept, used for the suggestion after a misspelt name."""


_UNMAPPED: Final = "unmapped"
_NO_MAPPING: Final = "; PDOs without a known mapping came: describe them by --eds"


class ExpressionRule:
    """A rule that was written as an expression, with the state of its check.

    A rule for several nodes is checked by one object for each node. A signal that the rule names
    must occur in the traffic, because its name may be misspelt. A rule that judges nothing does not
    count as passed.

    Args:
        name: name of the rule in findings and reports.
        demand: demand of the rule, such as `every 10ms`.
        scopes: scopes that restrict when the demand applies. If there are none, it always applies.
        missing: signals and words in the rule that have not occurred in the traffic yet.
        slices: signals in the rule that are bits of a frame, such as `181[2:4]`, and have not
            occurred yet.
        mapped: whether the rule needs the mapping of PDOs, because it is about their contents, or
            names PDOs by number.
    """

    def __init__(  # noqa: PLR0913 - what a rule is made of
        self,
        name: str,
        demand: demands.RuleDemand,
        scopes: Sequence[RuleScope],
        missing: filters.MissingSignals,
        slices: Sequence[_Slice],
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
        """Time until which `advance` has nothing to report."""
        return self._demand.due_us

    def take(self, record: Record, decoded: Decoded) -> TrafficFinding | None:
        """Return the violation in a frame."""
        if self._slices:
            decoded = _with_slices(record, decoded, self._slices)
        if self._looks:
            self._look(record, decoded)
        # without a scope nothing is called while it runs, which saves a third of the time of a rule
        if (self._scopes or not self._running) and not self._in_force(record, decoded):
            self._demand.watch(record, decoded)
            return None
        text = self._demand.judge(record, decoded)
        if not text:
            return None
        self._found = True
        return TrafficFinding(record.at_us, self.name, text, record)

    def advance(self, now_us: int) -> list[TrafficFinding]:
        """Return findings about frames that are overdue at this time. The check continues."""
        if now_us <= self.due_us:
            return []
        self._found = True
        return [
            TrafficFinding(fault.at_us, self.name, fault.text, fault.record)
            for fault in self._demand.expire()
        ]

    def end(self, end_us: int) -> list[TrafficFinding]:
        """Return the violations that are known only at the end, such as frames that never arrived.

        The method does not change the state of the rule, so that the check may continue.

        Args:
            end_us: time in microseconds up to which the traffic is judged.
        """
        texts = list(self._demand.end(end_us, self._running or not self._began))
        if not (texts or self._found):
            forbidden = dict(self._slices) if self._demand.forbids else ()  # these need not come
            missing = [path for path in self._missing.paths if path not in forbidden]
            texts = [f"no signal {path} came{self._near(path)}" for path in missing]
            texts += [f"no frame with {word} came" for word in self._missing.words]
        hint = "" if self._demand.came or not self._unmapped else _NO_MAPPING
        return [TrafficFinding(end_us, self.name, text + hint) for text in texts]

    def unjudged(self, evidence: CheckedTraffic) -> str:
        """Return why the rule has judged nothing, empty if it has judged something."""
        if not self._forced and self._scopes:
            return f"it was never in force: {' '.join(scope.text for scope in self._scopes)}"
        if not self._forced:
            return "no frame came"
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
        """Record which signals occur, until all have occurred. Record PDOs without a mapping."""
        if self._mapped and decoded.kind == _UNMAPPED:
            self._unmapped = True
        self._missing.take(record, decoded)
        self._looks = bool(self._missing) or (self._mapped and not self._unmapped)
        if len(self._names) < _MOST_NAMES:
            self._names.update(signal.name for signal in decoded.signals)

    def _near(self, path: str) -> str:
        _, name, _ = filters.signal_place(path)
        near = closest(name, [*filters.KINDS, *sorted(self._names)])
        return f"; did you mean {near[0]}?" if near and near[0] != name else ""


# Times, tolerances and sets of values, as rules have them.

_TIME: Final = re.compile(r"[0-9]{1,9}(?:\.[0-9]{1,9})?(?:s|ms|us)")
_SHARE: Final = re.compile(r"([0-9]{1,6}(?:\.[0-9]{1,6})?)%")


def _time_us(text: str) -> int | None:
    """Read a time with its unit, or return None if the text is not a time.

    >>> _time_us("1.5ms"), _time_us("2")
    (1500, None)
    """
    return parse_time_us(text) if _TIME.fullmatch(text) else None


def _tolerance_us(text: str, period_us: int) -> int | None:
    """Parse a percentage of a period, or a time. Return None if the text is neither.

    >>> _tolerance_us("10%", 10_000), _tolerance_us("250us", 10_000)
    (1000, 250)
    """
    share = _SHARE.fullmatch(text)
    return int(period_us * float(share[1]) / 100) if share else _time_us(text)


def _values_of(parts: Sequence[tuple[str, ...]]) -> Callable[[Signal], bool]:
    """Return a function that returns whether a signal has one of the given values.

    Args:
        parts: values. Each is a value, or the two ends of a range, of which one may be empty.

    Raises:
        ValueError: an end is not a number, or the lower one is above the other.

    >>> holds = _values_of([("7",), ("", "5")])
    >>> [holds(Signal("speed", value)) for value in (5, 6, 7)]
    [True, False, True]
    """
    tests = [
        filters.comparison("=", part[0]) if len(part) == 1 else _within(*part) for part in parts
    ]
    return lambda signal: any(test(signal) for test in tests)


def _within(low: str, high: str) -> Callable[[Signal], bool]:
    least, most = filters.number(low or "-inf"), filters.number(high or "inf")
    for text, end in ((low, least), (high, most)):
        if end is None or end != end:  # noqa: PLR0124 - not a number
            raise ValueError(f"{text!r} is no number, as an end of a range is")
    assert least is not None
    assert most is not None
    if not (low or high) or least > most:
        raise ValueError(f"{low}..{high} is no range of values, as -5..5, 0.. or ..100")

    def holds(signal: Signal) -> bool:
        value = signal.value
        return isinstance(value, int | float) and least <= value <= most

    return holds


# Arguments of a demand: times, spans, counts and sets of values.


class RuleError(FilterError):
    """A text that is not a rule."""

    what = "rule"


SCOPES: Final = ("after", "before", "while")
_UNITS: Final = ("s", "ms", "us", "%")
"""Units of quantities that have no blank before the unit."""

_COUNT: Final = re.compile(r"[0-9]{1,9}")


class _QuantityParser(_SliceParser):
    """Parser of quantities in the words of a rule.

    Args:
        text: text of the rule.
    """

    wrong = RuleError
    _word_column = 1

    def _whole(self) -> int:
        if not _COUNT.fullmatch(self._next.text):
            raise self._error(f"{self._came()} is no count, as 3")
        return int(self._tokens.pop(0).text)

    def _number(self) -> float:
        found = filters.number(self._next.text)
        if found is None or found != found:  # noqa: PLR0124 - not a number
            raise self._error(f"{self._came()} is no number")
        del self._tokens[0]
        return found

    def _under(self) -> int:
        """Read a limit of time."""
        if not self._take("under", "within"):
            raise self._error(f"{self._came()} where 'under' or 'within' and a time are wanted")
        return self._time()

    def _time(self) -> int:
        found = _time_us(self._next.text)
        if found is None:
            raise self._error(f"{self._came()} is no time, as 2s, 50ms or 250us{self._blank()}")
        del self._tokens[0]
        return found

    def _blank(self) -> str:
        """Report a blank between a number and its unit."""
        value, unit = self._tokens[0].text, self._tokens[1:2]
        if filters.number(value) is None or not unit or unit[0].text not in _UNITS:
            return ""
        return f"; without a blank, as {value}{unit[0].text}"

    def _span(self) -> tuple[int, int | None]:
        """Read the allowed time between frames: `10ms ±10%`, `9ms..11ms`, `5ms..`, `..20ms`."""
        if self._take(".."):
            return 0, self._time()
        low_us = self._time()
        if self._take(".."):
            is_open = _time_us(self._next.text) is None and not self._next.text[:1].isdecimal()
            return self._ordered(low_us, None if is_open else self._time())
        if not self._take("±", "+-"):
            wanted = "wanted how far off is right, as ±10%, ±500us or 9ms..11ms"
            raise self._error(f"{self._came()} behind the time; {wanted}")
        off_us = _tolerance_us(self._next.text, low_us)
        if off_us is None:
            wanted = "neither a share, as 10%, nor a time, as 500us"
            raise self._error(f"{self._came()} is {wanted}{self._blank()}")
        del self._tokens[0]
        return max(0, low_us - off_us), low_us + off_us

    def _ordered(self, low_us: int, high_us: int | None) -> tuple[int, int | None]:
        if high_us is not None and high_us < low_us:
            raise self._error("the time before '..' is above the one behind it")
        return low_us, high_us

    def _values(self) -> tuple[str, Callable[[Signal], bool]]:
        """Read the allowed values, such as `{1, 8130h, 5..9, stopped}`, or `1..5` alone."""
        begin = self._next.column - 1
        parts = [self._value()] if not self._take("{") else self._members()
        text = self._text[begin : self._next.column - 1].strip()
        try:
            return text, _values_of(parts)
        except ValueError as error:
            raise self._error(str(error)) from None

    def _members(self) -> list[tuple[str, ...]]:
        parts = [self._value()]
        while self._take(","):
            parts.append(self._value())
        self._expect("}")
        return parts

    def _value(self) -> tuple[str, ...]:
        """Read a value, or both ends of a range. An open end is empty."""
        low = "" if self._next.text == ".." else self._word()
        if not self._take(".."):
            return (low,)
        is_open = not self._next.text or self._next.text in (*SCOPES, ",", "}")
        return low, "" if is_open else self._word()

    def _word(self) -> str:
        if not re.match(r"[\w.+-]", self._next.text):
            raise self._error(f"{self._came()} where a value is wanted, as 8130h, 5..9 or {{1, 2}}")
        return self._tokens.pop(0).text

    def _take_one(self, *words: str) -> str:
        """Read the next token if it is one of these. Return the token, or an empty text."""
        word, column = self._next
        if not self._take(*words):
            return ""
        self._word_column = column
        return word

    def _refuse_word(self, reason: str) -> RuleError:
        """Return the error about the word that `_take_one` read."""
        return RuleError(self._text, self._word_column, reason)

    def _came(self) -> str:
        return repr(self._next.text) if self._next.text else "the end"


# EMCYs that clear an error, which do not count as errors.

_EMCY: Final = "emcy"
_OTHERS: Final = frozenset(["not", "!", "!="])


def errors_alone(
    test: filters.Test, tokens: Iterable[Token], signals: Collection[str]
) -> filters.Test:
    """Return the test of a filter, changed so that EMCYs with error code 0000h do not pass.

    A rule such as `emcy never` should match only errors, and such an EMCY reports that an error is
    gone.

    The test is returned unchanged in these cases:

    - The filter lacks the word `emcy`.
    - The filter contains the word `not`.
    - The filter names a signal of the EMCY, as in `emcy and code = 0`.

    Args:
        test: function that returns whether a frame passes the filter.
        tokens: words and signs of the filter.
        signals: names of the signals in the filter.
    """
    words = {token.text for token in tokens}
    if any(map(demands.AtFrames.is_event_signal, signals)) or _EMCY not in words or words & _OTHERS:
        return test
    return lambda record, decoded: test(record, decoded) and not _is_reset(decoded)


def _is_reset(decoded: Decoded) -> bool:
    return decoded.kind == _EMCY and bool(decoded.signals) and not decoded.signals[0].value


def _any_of(tests: Sequence[filters.Test]) -> filters.Test:
    return lambda record, decoded: any(test(record, decoded) for test in tests)


def _all_of(tests: Sequence[filters.Test]) -> filters.Test:
    if len(tests) == 1:
        return tests[0]
    return lambda record, decoded: all(test(record, decoded) for test in tests)


_NO_EVENT: Final = ("node", "channel", "ch", "dir", "src", "dlc", "bytes", "not", "!")
"""First words of terms that only restrict frames, so that a frame is not an event by them."""

DEMANDS: Final = (
    *("never", "always", "once", "at most", "at least", "in", "every", "within", "to"),
    *("answered", "dlc", "toggle", "counts", "steps", "changes"),
)
_SCOPE: Final[dict[str, type[RuleScope]]] = {
    "after": _After,
    "before": _Before,
    "while": _While,
}
_PLAIN: Final[dict[str, Callable[[demands.RuleEvent], demands.RuleDemand]]] = {
    "once": lambda event: demands.Count(event, 1, 1),
    "dlc": demands.Dlc,
    "toggle": demands.Toggle,
}
BEHIND: Final = {
    "after": "the demand, as tpdo1 of 3 within 2ms after sync",
    "before": "the demand, as emcy never before sync",
    "while": "the demand, as emcy never while node 3 stopped",
    **dict.fromkeys(filters.NMT_STATES, "a node, as node 3 stopped"),
}
"""Words that are not a demand, and the words that they follow."""

_EACH_NODE: Final = (
    demands.Every,
    demands.FirstWithin,
    demands.Latency,
    demands.Count,
    demands.Rate,
)
"""Demands that apply to each node if several nodes are named.

Other demands distinguish the nodes.
"""

_NODES: Final = re.compile(r"\b(of|node)(\s+)([0-9]{1,3}-[0-9]{1,3})(?![\w.])")
_ID_WORD: Final = re.compile(r"[0-9A-Fa-f]{3}(?:[0-9A-Fa-f]{5})?(?:-[0-9A-Fa-f]{3,8})?|id|==?|or|,")
_OF: Final = re.compile(r"(?<!\s)\s++of\s")
_OWN_NODE: Final = re.compile(r"[0-9]{1,3}\.")


class _RuleParser(_QuantityParser):
    """Recursive descent parser for the grammar above.

    Args:
        text: text of the rule.
    """

    def rule(
        self,
    ) -> tuple[demands.RuleDemand, list[RuleScope], set[str], list[_Slice]]:
        """Parse the whole rule, and return its demand, scopes, signals and frame slices.

        A frame slice is a value that is defined by the position of its bits in a frame.

        Raise RuleError if the text is not a rule.
        """
        self._named: set[str] = set()
        self._at_frames: demands.AtFrames | None = None
        self._alone: filters.Test | None = None
        demand = self._demand(self._subject())
        scopes = []
        while word := self._take_one(*SCOPES):
            event = self._condition() if word == "while" else self._event()
            scopes.append(_SCOPE[word](word, event))
        if self._next.text:
            raise self._error(
                f"{self._came()} behind the end; wanted {', '.join(SCOPES)}, or no more"
            )
        return demand, scopes, self._named, list(self._slices.items())

    def _subject(self) -> demands.RuleEvent:
        if self._next.text != "dlc" or self._tokens[1].text in filters.COMPARISONS:
            return self._event()
        if self._tokens[1].text != "of":
            return demands.EVERY
        del self._tokens[1]
        nodes = self._nodes_behind()
        return demands.RuleEvent(demands.EVERY.text, lambda record, decoded: decoded.node in nodes)

    def _nodes_behind(self) -> range:
        """Read node-IDs that follow the next token."""
        word = self._tokens.pop(0)
        nodes = self._node_ids()
        self._tokens.insert(0, word)
        return nodes

    def _or(self) -> filters.Test:
        tests, alone = list[filters.Test](), list[filters.Test]()
        outer, self._signals, named = self._signals, set(), set[str]()
        while True:
            tests.append(self._and())
            if not self._signals or self._at_frames is not None:
                alone.append(tests[-1])
            named, self._signals = named | self._signals, set()
            if not self._take("or", ","):
                break
        self._signals = outer | named
        if len(tests) == 1:
            return tests[0]
        self._at_frames, self._alone = None, _any_of(alone) if alone and named else None
        return _any_of(tests)

    def _and(self) -> filters.Test:
        frames, states = list[filters.Test](), list[tuple[filters.Test, set[str]]]()
        outer, each, first = self._signals, False, self._next.text
        while True:
            is_event, self._signals = self._next.text not in _NO_EVENT, set()
            self._at_frames = self._alone = None
            test = self._not()
            if self._signals:
                states.append((test, self._signals))
            else:
                frames.append(test)
                each |= is_event
            outer = outer | self._signals
            if not self._take("and"):
                break
        self._signals = outer
        if first == "(" and len(frames) + len(states) == 1:
            return test
        self._at_frames = self._alone = None
        if not (frames and states):
            return _all_of(frames or [test for test, _ in states])
        self._at_frames = demands.AtFrames(frames, states, each=each)
        return self._at_frames

    def _event(self) -> demands.RuleEvent:
        """Read a filter up to its end."""
        tokens, signals, nodes = list(self._tokens), self._signals, self._nodes
        self._signals, self._nodes = set(), set()
        test = self._or()
        at_frames, alone = self._at_frames, self._alone
        taken = tokens[: len(tokens) - len(self._tokens)]
        paths, words = tuple(sorted(self._signals)), [token.text for token in taken]
        self._named |= self._signals
        has_node = bool(self._nodes) or "node" in words or any(map(_OWN_NODE.match, paths))
        self._signals, self._nodes = self._signals | signals, self._nodes | nodes
        last = taken[-1]
        text = self._text[taken[0].column - 1 : last.column - 1 + len(last.text)]
        name = _OF.split(text)[0]
        is_signal = any(path == name or path.endswith(f".{name}") for path in paths)
        if self._next.text != "dlc":  # of an error reset, too
            if at_frames is not None:
                every = demands.EVERY.matches
                errors = errors_alone(every, taken, paths)
                at_frames.select(*[errors] * (errors is not every))
            test = at_frames or errors_alone(test, taken, paths)
            alone = alone and errors_alone(alone, taken, paths)
        is_id = all(_ID_WORD.fullmatch(word) for word in words)
        return demands.RuleEvent(text, test, paths, is_signal, has_node, at_frames, alone, is_id)

    def _condition(self) -> demands.RuleEvent:
        return self._with_signals(self._event(), "while")

    def _with_signals(self, event: demands.RuleEvent, word: str) -> demands.RuleEvent:
        if not event.paths:
            reason = f"{word!r} wants a signal or a state, as 3.statusword.fault or node 3 stopped"
            raise self._refuse_word(f"{reason}; {event.text!r} names none")
        return event

    def _demand(self, event: demands.RuleEvent) -> demands.RuleDemand:
        word = self._take_one("at") or self._take_one(*DEMANDS)
        if word in _PLAIN:
            return _PLAIN[word](event)
        match word:
            case "never":
                return demands.Truth(event, wanted=False) if event.paths else demands.Never(event)
            case "always":
                return demands.Truth(self._with_signals(event, word), wanted=True)
            case "at":
                return self._count(event)
            case "in" | "steps" | "counts" | "changes":
                return self._value_demand(event, word)
            case _:
                return self._time_demand(event, word)

    def _time_demand(self, event: demands.RuleEvent, word: str) -> demands.RuleDemand:
        match word:
            case "every":
                return demands.Every(event, *self._span())
            case "within":
                most_us = self._time()
                if self._take("after"):
                    return demands.Latency(self._event(), event, most_us)
                return demands.FirstWithin(event, most_us)
            case "to":
                second = self._event()
                return demands.Latency(event, second, self._under())
            case "answered":
                return demands.Answered(event, self._under())
            case _:
                raise self._error(f"{self._came()} is no demand; {self._allowed()}")

    def _value_demand(self, event: demands.RuleEvent, word: str) -> demands.RuleDemand:
        if len(event.paths) > 1 or (event.paths and not event.is_signal):
            reason = f"{word!r} is about one signal, as 3.position, or about one kind"
            raise self._refuse_word(reason)
        match word:
            case "in":
                return demands.In(event, *self._values())
            case "steps":
                self._expect("under")
                return demands.Steps(event, self._number())
            case "changes":
                return demands.Changes(event, self._under())
            case _:
                return demands.Counts(event)

    def _count(self, event: demands.RuleEvent) -> demands.RuleDemand:
        word = self._take_one("most", "least")
        if not word:
            raise self._error(f"{self._came()} behind 'at'; wanted most or least")
        count = self._whole()
        if word == "least":
            return demands.Count(event, count, None)
        if not self._take("per"):
            return demands.Count(event, 0, count)
        if count > demands.MOST_COUNTED:
            raise self._error(
                f"at most {count}: at most {demands.MOST_COUNTED} can be counted in a time"
            )
        return demands.Rate(event, count, self._time())

    def _allowed(self) -> str:
        word = self._next.text
        if word in BEHIND:
            return f"it stands behind {BEHIND[word]}"
        near = closest(word, [*DEMANDS, *SCOPES, *filters.NMT_STATES]) if word else []
        meant = f"; did you mean {near[0]!r}?" if near else ""
        return f"wanted {', '.join(DEMANDS)}, or 'and', 'or'{meant}"


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed rule that was written as an expression, such as `tpdo1 of 3-4 every 10ms`.

    Attributes:
        name: name of the rule in findings and reports.
        texts: text of the rule for each node. A rule that does not depend on the node has one text.
    """

    name: str
    texts: tuple[str, ...]

    def make(self) -> list[ExpressionRule]:
        """Return new rules without any state."""
        return [_made(self.name, text) for text in self.texts]


def _made(name: str, text: str) -> ExpressionRule:
    parser = _RuleParser(text)
    demand, scopes, paths, slices = parser.rule()
    cuts = dict(slices)
    mapped = "pdo" in text or any("." in path for path in paths if path not in cuts)
    unsure = [path for path in paths if not demands.AtFrames.is_event_signal(path)]
    missing = filters.MissingSignals(unsure, parser.words)
    return ExpressionRule(name, demand, scopes, missing, slices, mapped=mapped)


def parse_rule(text: str, name: str = "") -> Expression:
    """Parse a rule that is written as an expression, such as `181 every 10ms`.

    Args:
        text: text of the rule.
        name: name of the rule in findings and reports. If it is empty, the text of the rule is
            used.

    Raises:
        RuleError: the text is not a rule. The message names the column of the error.
    """
    demand, *_ = _RuleParser(text).rule()
    name = name or " ".join(text.split())
    if not name.isprintable():
        raise RuleError(text, 1, f"its name {name!r} cannot be printed")
    ranges = {match[3] for match in _NODES.finditer(text)}
    if not isinstance(demand, _EACH_NODE) or not ranges or re.search(r"\bnot\b|!", text):
        return Expression(name, (text,))
    if len(ranges) > 1:
        said = " and ".join(sorted(ranges))
        raise RuleError(text, 1, f"nodes {said}: a rule that is made for each node names one range")
    first, _, last = next(iter(ranges)).partition("-")
    nodes = range(int(first), int(last) + 1)
    return Expression(name, tuple(_NODES.sub(rf"\g<1>\g<2>{node}", text) for node in nodes))
