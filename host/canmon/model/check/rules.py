"""All rules of a check, as values, and as text on a command line or in TOML."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.check import rule
from tickrig.host.canmon.model.check.rule import Rule
from tickrig.host.canmon.model.frames import FD, REMOTE, ident_text, parse_ident
from tickrig.host.text.names import closest
from tickrig.host.text.toml_reader import load_toml, read_toml
from tickrig.host.text.values import counted, parse_time_with_unit_us
from tickrig.wire.can import EXTENDED_MAX

if TYPE_CHECKING:
    from tickrig.host.canmon.model.check.rule_parser import Expression


NO_LOSS: Final = "no-loss"
"""Name of the rule that no frame is lost, and that every line of a log is a frame."""


EdsHeartbeats = Mapping[int, int]
NO_EDS: Final[EdsHeartbeats] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """All rules that a check applies, as given on the command line or in a TOML file.

    Attributes:
        max_load: largest load of any second in percent of the bit rate, or None for no limit.
        bit_rate: bit rate in bits per second, if it is not known otherwise. The bit rate is not a
            rule by itself.
        no_emcy: whether EMCY messages except error reset are forbidden.
        no_sdo_abort: whether aborted SDO transfers are forbidden.
        no_error_frames: whether error frames are forbidden.
        no_reboot: whether a second boot-up of a node without an NMT reset is forbidden.
        no_lost_heartbeat: whether a node must not stop sending heartbeats.
        no_loss: whether lost frames and invalid lines in a log are forbidden.
        heartbeats: limits of the heartbeat times of some nodes.
        nodes: nodes that must be present.
        max_gaps: identifiers and the longest allowed gap of each, in microseconds.
        known: all allowed identifiers, or None to allow any identifier.
        others: factories of further rules from installed packages.
        expressions: rules about decoded frames. `Checker` checks them if it gets decoded frames.
            The block-wise check does not support them.
    """

    max_load: float | None = None
    bit_rate: int | None = None
    no_emcy: bool = False
    no_sdo_abort: bool = False
    no_error_frames: bool = False
    no_reboot: bool = False
    no_lost_heartbeat: bool = False
    no_loss: bool = False
    heartbeats: tuple[rule.HeartbeatTimes, ...] = ()
    nodes: tuple[int, ...] = ()
    max_gaps: tuple[tuple[int, int], ...] = ()
    known: frozenset[int] | None = None
    others: tuple[Callable[[], Rule], ...] = ()
    expressions: tuple[Expression, ...] = ()

    def names(self) -> list[str]:
        """Return the names of all rules, used in a report."""
        names = ["max-load"] * (self.max_load is not None) + [NO_LOSS] * self.no_loss
        names += [rule.name for rule in self.make()]
        return list(dict.fromkeys([*names, *(one.name for one in self.expressions)]))

    def make(self, eds_heartbeats: EdsHeartbeats = NO_EDS) -> list[Rule]:
        """Return a new `Rule` object for each rule that does not need decoded frames.

        A rule object keeps the state of one check, so that each check needs new objects.

        Args:
            eds_heartbeats: producer heartbeat times (1017h) from EDS files, in ms, by node-ID.
        """
        made: list[Rule] = []
        made += [rule.NoEmcy()] * self.no_emcy
        made += [rule.NoSdoAbort()] * self.no_sdo_abort
        made += [rule.NoErrorFrames()] * self.no_error_frames
        made += [rule.NoReboot()] * self.no_reboot
        made += [rule.NoLostHeartbeat(eds_heartbeats)] if self.no_lost_heartbeat else []
        made += [rule.Heartbeat(times) for times in self.heartbeats]
        made += [rule.NodesPresent(self.nodes)] * bool(self.nodes)
        made += [rule.MaxGap(*gap) for gap in self.max_gaps]
        made += [rule.KnownIds(self.known)] if self.known is not None else []
        made += [make() for make in self.others]
        return made

    def load(self, bit_rate: int | None) -> rule.MaxLoad | None:
        """Return the rule that limits the bus load, or None if there is no limit.

        Raise ValueError if there is a limit, but the bit rate is unknown.

        Args:
            bit_rate: bit rate of the bus in bits per second, or None to use the bit rate of the
                rules.
        """
        if self.max_load is None:
            return None
        bit_rate = self.bit_rate if bit_rate is None else bit_rate
        if bit_rate is None:
            raise ValueError("a limit of the load needs the bit rate: give -b, as -b 500000")
        return rule.MaxLoad(self.max_load, bit_rate)


RuleValues = Mapping[str, object]
"""Rules by their names with underscores.

A value is True, a number, text, list of texts, or table.
"""

_LoadRule = Callable[[str], Callable[[], Rule]]

SWITCHES: Final = (
    "no_emcy",
    "no_sdo_abort",
    "no_error_frames",
    "no_reboot",
    "no_lost_heartbeat",
    "no_loss",
)
_NUMBERS: Final = ("max_load", "bitrate")
_LISTS: Final = ("heartbeat", "nodes", "max_gap", "known", "rule")
VALUES: Final = (*_NUMBERS, *_LISTS)

_HEARTBEAT: Final = re.compile(r"([0-9]{1,3})=([^±+]+)(?:±|\+-)([0-9]+(?:\.[0-9]+)?)(%|s|ms|us)")
_NAMES: Final = re.compile(r"[\w.-]*(?:\s*,\s*[\w.-]+)*", re.ASCII)
_NAMED: Final = re.compile(r"(.*\S): (.*)", re.DOTALL)
_ONE_WORD: Final = ("dlc",)
"""Expressions that consist of one word, and are not names of rules."""
_NODES: Final = re.compile(r"([0-9]{1,9})(?:-([0-9]{1,9}))?")
_MAX_NODE: Final = 127
_MAX_IDENTS: Final = 1 << 16


def _no_rule(name: str) -> Callable[[], Rule]:
    raise ValueError(f"no rule {name!r}")


def parse_rules(words: RuleValues, load_rule: _LoadRule = _no_rule) -> Rules:
    """Return the rules that are given by name, as in a TOML file or on the command line.

    Args:
        words: values of the rules by name of the rule, such as `no_emcy`.
        load_rule: function that returns the factory of a rule from an installed package, by the
            name of that rule.

    Raises:
        ValueError: a rule is unknown, or its value is invalid.

    >>> parse_rules({"no_emcy": True, "heartbeat": ["3=100ms±20%"]}).heartbeats
    (HeartbeatTimes(node=3, low_us=80000, high_us=120000),)
    """
    known = (*SWITCHES, *VALUES)
    for name in words:
        if name not in known:
            meant = "".join(f"; did you mean {word!r}?" for word in closest(name, known))
            raise ValueError(f"rule {name!r} is not one of {', '.join(known)}{meant}")
    switches = {name: _switch(name, words[name]) for name in SWITCHES if name in words}
    gaps = (text.partition("=") for text in _texts("max_gap", words))
    idents = [ident for text in _lists("known", words) for ident in _idents(text)]
    nodes = {node for text in _lists("nodes", words) for node in _nodes(text)}
    for name in ("heartbeat", "nodes", "max_gap", "rule"):
        if name in words and not _texts(name, words):
            raise ValueError(f"{name} is empty: leave it out, or it is taken for a rule that holds")
    others, expressions = _named_and_written(_texts("rule", words))
    return Rules(
        **switches,
        max_load=_percent(words.get("max_load")),
        bit_rate=_bit_rate(words.get("bitrate")),
        heartbeats=tuple(_heartbeat(text) for text in _texts("heartbeat", words)),
        nodes=tuple(sorted(nodes)),
        max_gaps=tuple((parse_ident(ident), _time_us(time)) for ident, _, time in gaps),
        known=frozenset(idents) if "known" in words else None,
        others=tuple(map(load_rule, others)),
        expressions=expressions,
    )


def joined(first: RuleValues, second: RuleValues) -> RuleValues:
    """Return the rules of two sets, such as those of a file and those of the command line.

    If the value of a rule is a list, the result contains the items of both lists. For other rules,
    the value of the second set replaces that of the first set.

    >>> joined({"known": "181", "max_load": 50}, {"known": ["182"], "max_load": 60})
    {'known': ['181', '182'], 'max_load': 60}
    """
    out = dict(first)
    for name, value in second.items():
        both = name in _LISTS and name in first
        out[name] = [*_texts(name, first), *_texts(name, second)] if both else value
    return out


def _named_and_written(texts: Iterable[str]) -> tuple[list[str], tuple[Expression, ...]]:
    """Separate names of rules of other packages from rules that are written as expressions."""
    names: list[str] = []
    expressions: list[Expression] = []
    for text in texts:
        if _NAMES.fullmatch(text) and text not in _ONE_WORD:
            names += [part.strip() for part in text.split(",")]
            continue
        from tickrig.host.canmon.model.check.rule_parser import parse_rule  # noqa: PLC0415 - seldom wanted

        named = _NAMED.fullmatch(text)
        expressions.append(parse_rule(named[2], named[1].strip()) if named else parse_rule(text))
    return names, tuple(expressions)


def _switch(name: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{name} = {value!r} is not true or false")
    return value


def _percent(value: object) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 100:
        raise ValueError(f"max_load {value!r} is not 0 to 100 percent")
    return value


def _bit_rate(value: object) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int) or value <= 0:
        raise ValueError(f"bitrate {value!r} is not a number of bits a second, as 500000")
    return value


def _texts(name: str, words: RuleValues) -> list[str]:
    """Return the values of a rule as texts.

    A table becomes texts with `=`, or with `: ` for `rule`.
    """
    value = words.get(name, ())
    if isinstance(value, Mapping):
        sign = ": " if name == "rule" else "="
        return [f"{key}{sign}{entry}" for key, entry in value.items()]
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [str(entry) for entry in value]
    return [str(value)]


def _lists(name: str, words: RuleValues) -> list[str]:
    return [part.strip() for text in _texts(name, words) for part in text.split(",")]


def _heartbeat(text: str) -> rule.HeartbeatTimes:
    match = _HEARTBEAT.fullmatch(text)
    if match is None or not 1 <= int(match[1]) <= _MAX_NODE:
        raise ValueError(f"heartbeat {text!r} is not like 3=100ms±20% or 3=100ms+-5ms")
    period_us = _time_us(match[2])
    if match[4] == "%":
        off_us = int(period_us * float(match[3]) / 100)
    else:
        off_us = _time_us(match[3] + match[4])
    return rule.HeartbeatTimes(int(match[1]), max(0, period_us - off_us), period_us + off_us)


def _time_us(text: str) -> int:
    return parse_time_with_unit_us(text.strip())


def _nodes(text: str) -> range:
    match = _NODES.fullmatch(text)
    if match is None:
        raise ValueError(f"nodes {text!r} is not like 3 or 3-7")
    first, last = int(match[1]), int(match[2] or match[1])
    if first > last:
        raise ValueError(f"nodes {text!r}: the lower node-ID stands first, as {last}-{first}")
    if first < 1 or last > _MAX_NODE:
        raise ValueError(f"nodes {text!r}: node-IDs are 1 to {_MAX_NODE}")
    return range(first, last + 1)


def _idents(text: str) -> Iterator[int]:
    """Yield identifiers.

    Identifiers without a word on remote frames stand for remote frames too.
    """
    words = text.split("-")
    if len(words) > 2 or not all(words):
        raise ValueError(f"known {text!r} is not like 181 or 181-18F")
    first, last = parse_ident(words[0]), parse_ident(words[-1])
    if (first ^ last) & ~EXTENDED_MAX:
        raise ValueError(f"known {text!r}: write both ends alike, as 181-18F or 181R-18FR")
    if not 0 < last + 1 - first <= _MAX_IDENTS:
        raise ValueError(f"known {text!r}: {ident_text(first)} is not below the other end")
    for ident in range(first, last + 1):
        yield ident
        if not ident & FD:
            yield ident | REMOTE


# A file of rules, in TOML: all errors are reported at once.


def parse_rule_file(text: str, load_rule: _LoadRule) -> RuleValues:
    """Parse a TOML file with rules, and return the value of each rule by its name.

    Args:
        text: text of the whole file.
        load_rule: function that returns the factory of a rule from an installed package, by the
            name of that rule.

    Raises:
        ValueError: the file has mistakes. The message describes each mistake and names its line.
    """
    try:
        words = load_toml(text)
        parse_rules(words, load_rule)
    except ValueError as error:
        mistakes = _mistakes(text, load_rule) or [str(error)]
        if len(mistakes) == 1:
            raise ValueError(mistakes[0]) from None
        lines = (f"\n  {mistake}" for mistake in mistakes)
        raise ValueError(f"{counted(len(mistakes), 'mistake')}{''.join(lines)}") from None
    return words


def _mistakes(text: str, load_rule: _LoadRule) -> list[str]:
    """Try each rule alone. Report only the syntax error of invalid TOML."""
    document = read_toml(text)
    found = [(line, reason) for line, reason in document.mistakes]
    for path, words in () if found else _alone(document.values):
        try:
            parse_rules(words, load_rule)
        except ValueError as error:
            found.append((document.line_of(path), str(error)))
    return [f"line {line}: {reason}" for line, reason in sorted(found)]


def _alone(words: RuleValues) -> Iterator[tuple[tuple[str | int, ...], RuleValues]]:
    """Yield each rule with its path."""
    for name, value in words.items():
        if name in _LISTS and isinstance(value, Mapping):
            yield from (((name, key), {name: {key: entry}}) for key, entry in value.items())
        elif name in _LISTS and isinstance(value, list):
            yield from (((name, at), {name: [entry]}) for at, entry in enumerate(value))
        else:
            yield (name,), {name: value}
