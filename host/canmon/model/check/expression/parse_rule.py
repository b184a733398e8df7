"""Rules as people write them: an event in the words of `-F`, what is demanded of it, and when.

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
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.canmon.model.check.expression.demand import Demand
from tickrig.host.canmon.model.check.expression.error_resets import errors_alone
from tickrig.host.canmon.model.check.expression.event import EVERY, Event
from tickrig.host.canmon.model.check.expression.event_demands import (
    MOST_COUNTED,
    Count,
    Never,
    Rate,
    Truth,
)
from tickrig.host.canmon.model.check.expression.expression_rule import ExpressionRule
from tickrig.host.canmon.model.check.expression.form_demands import Dlc, Toggle
from tickrig.host.canmon.model.check.expression.quantity_parser import (
    SCOPES,
    QuantityParser,
    RuleError,
)
from tickrig.host.canmon.model.check.expression.scope import After, Before, Scope, While
from tickrig.host.canmon.model.check.expression.slice_parser import Slice
from tickrig.host.canmon.model.check.expression.time_demands import (
    Answered,
    Every,
    FirstWithin,
    Latency,
)
from tickrig.host.canmon.model.check.expression.value_demands import Changes, Counts, In, Steps
from tickrig.host.canmon.model.decode.filter_terms import COMPARISONS, NMT_STATES
from tickrig.host.text.names import closest

DEMANDS: Final = (
    *("never", "always", "once", "at most", "at least", "in", "every", "within", "to"),
    *("answered", "dlc", "toggle", "counts", "steps", "changes"),
)
SCOPE: Final[dict[str, Callable[[Event], Scope]]] = {
    "after": After,
    "before": Before,
    "while": While,
}
PLAIN: Final[dict[str, Callable[[Event], Demand]]] = {
    "once": lambda event: Count(event, 1, 1),
    "dlc": Dlc,
    "toggle": Toggle,
}
BEHIND: Final = {
    "after": "the demand, as tpdo1 of 3 within 2ms after sync",
    "before": "the demand, as emcy never before sync",
    "while": "the demand, as emcy never while node 3 stopped",
    **dict.fromkeys(NMT_STATES, "a node, as node 3 stopped"),
}
"""Words that are no demand, and what they stand behind."""

EACH_NODE: Final = (Every, FirstWithin, Latency, Count, Rate)
"""Demands that are made of each node where several are named; the others tell them apart."""

_NODES: Final = re.compile(r"\b(of|node)(\s+)([0-9]{1,3}-[0-9]{1,3})(?![\w.])")
_OF: Final = re.compile(r"(?<!\s)\s++of\s")
_OWN_NODE: Final = re.compile(r"[0-9]{1,3}\.")


class RuleParser(QuantityParser):
    """Recursive descent over the grammar above.

    Args:
        text: the rule.
    """

    def rule(self) -> tuple[Demand, list[Scope], set[str], list[Slice]]:
        """Return demand, scopes, signals and slices that are named; RuleError if it is no rule."""
        self._named: set[str] = set()
        demand = self._demand(self._subject())
        scopes = []
        while word := self._take_one(*SCOPES):
            scopes.append(SCOPE[word](self._condition() if word == "while" else self._event()))
        if self._next.text:
            raise self._error(
                f"{self._came()} behind the end; wanted {', '.join(SCOPES)}, or no more"
            )
        return demand, scopes, self._named, list(self._slices.items())

    def _subject(self) -> Event:
        if self._next.text != "dlc" or self._tokens[1].text in COMPARISONS:
            return self._event()
        if self._tokens[1].text != "of":
            return EVERY
        del self._tokens[1]
        nodes = self._nodes_behind()
        return Event(EVERY.text, lambda record, decoded: decoded.node in nodes)

    def _nodes_behind(self) -> range:
        """Take node-IDs that stand behind the next token."""
        word = self._tokens.pop(0)
        nodes = self._node_ids()
        self._tokens.insert(0, word)
        return nodes

    def _event(self) -> Event:
        """Take a filter, as far as it goes."""
        tokens, signals, nodes = list(self._tokens), self._signals, self._nodes
        self._signals, self._nodes = set(), set()
        test = self._or()
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
            test = errors_alone(test, taken, paths)
        return Event(text, test, paths, is_signal, has_node)

    def _condition(self) -> Event:
        return self._with_signals(self._event(), "while")

    def _with_signals(self, event: Event, word: str) -> Event:
        if not event.paths:
            reason = f"{word!r} wants a signal or a state, as 3.statusword.fault or node 3 stopped"
            raise self._refuse_word(f"{reason}; {event.text!r} names none")
        return event

    def _demand(self, event: Event) -> Demand:
        word = self._take_one("at") or self._take_one(*DEMANDS)
        if word in PLAIN:
            return PLAIN[word](event)
        match word:
            case "never":
                return Truth(event, wanted=False) if event.paths else Never(event)
            case "always":
                return Truth(self._with_signals(event, word), wanted=True)
            case "at":
                return self._count(event)
            case "in" | "steps" | "counts" | "changes":
                return self._value_demand(event, word)
            case _:
                return self._time_demand(event, word)

    def _time_demand(self, event: Event, word: str) -> Demand:
        match word:
            case "every":
                return Every(event, *self._span())
            case "within":
                most_us = self._time()
                first = self._event() if self._take("after") else None
                return Latency(first, event, most_us) if first else FirstWithin(event, most_us)
            case "to":
                second = self._event()
                return Latency(event, second, self._under())
            case "answered":
                return Answered(event, self._under())
            case _:
                raise self._error(f"{self._came()} is no demand; {self._allowed()}")

    def _value_demand(self, event: Event, word: str) -> Demand:
        if len(event.paths) > 1 or (event.paths and not event.is_signal):
            reason = f"{word!r} is about one signal, as 3.position, or about one kind"
            raise self._refuse_word(reason)
        match word:
            case "in":
                return In(event, self._values())
            case "steps":
                self._expect("under")
                return Steps(event, self._number())
            case "changes":
                return Changes(event, self._under())
            case _:
                return Counts(event)

    def _count(self, event: Event) -> Demand:
        word = self._take_one("most", "least")
        if not word:
            raise self._error(f"{self._came()} behind 'at'; wanted most or least")
        count = self._whole()
        if word == "least":
            return Count(event, count, None)
        if not self._take("per"):
            return Count(event, 0, count)
        if count > MOST_COUNTED:
            raise self._error(f"at most {count}: at most {MOST_COUNTED} can be counted in a time")
        return Rate(event, count, self._time())

    def _allowed(self) -> str:
        word = self._next.text
        if word in BEHIND:
            return f"it stands behind {BEHIND[word]}"
        near = closest(word, [*DEMANDS, *SCOPES, *NMT_STATES]) if word else []
        meant = f"; did you mean {near[0]!r}?" if near else ""
        return f"wanted {', '.join(DEMANDS)}, or 'and', 'or'{meant}"


@dataclass(frozen=True, slots=True)
class Expression:
    """A rule that was read.

    Attributes:
        name: as findings and reports have it.
        texts: the rule, once for each node that it is demanded of.
    """

    name: str
    texts: tuple[str, ...]

    def make(self) -> list[ExpressionRule]:
        """Return new rules that have seen nothing yet."""
        return [_made(self.name, text) for text in self.texts]


def _made(name: str, text: str) -> ExpressionRule:
    demand, scopes, paths, slices = RuleParser(text).rule()
    mapped = "pdo" in text or any("." in path for path in paths)
    return ExpressionRule(name, demand, scopes, paths, slices, mapped=mapped)


def parse_rule(text: str, name: str = "") -> Expression:
    """Read a rule.

    Args:
        text: the rule.
        name: what findings call it; empty for the rule itself.

    Raises:
        RuleError: it is none; says the column.
    """
    demand, *_ = RuleParser(text).rule()
    name = name or " ".join(text.split())
    if not name.isprintable():
        raise RuleError(text, 1, f"its name {name!r} cannot be printed")
    ranges = {match[3] for match in _NODES.finditer(text)}
    if not isinstance(demand, EACH_NODE) or not ranges or re.search(r"\bnot\b|!", text):
        return Expression(name, (text,))
    if len(ranges) > 1:
        said = " and ".join(sorted(ranges))
        raise RuleError(text, 1, f"nodes {said}: a rule that is made for each node names one range")
    first, _, last = next(iter(ranges)).partition("-")
    nodes = range(int(first), int(last) + 1)
    return Expression(
        name,
        tuple(_NODES.sub(rf"\g<1>\g<2>{node}", text) for node in nodes),
    )
