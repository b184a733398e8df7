"""Decoders and check rules that installed packages add to `canmon` (docs/howto/extending.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from tickrig.host.canmon.model.check.rule import Rule
from tickrig.host.canmon.model.check.rules import SWITCHES
from tickrig.host.cli.extensions import ExtensionError, ExtensionGroup
from tickrig.host.cli.messages import Refused, say
from tickrig.host.text.names import closest
from tickrig.host.text.user_file import explain_error

if TYPE_CHECKING:
    from tickrig.host.canmon.model.check.rule import CheckedTraffic, FrameSelection
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.decode.decoder import Decoder, FrameDecoder
    from tickrig.host.canmon.model.decode.node_memory import EdsObjects
    from tickrig.host.canmon.model.frames import Record

_T = TypeVar("_T")

_DECODER: Final = ("decode",)
_RULE: Final = ("wants", "selection", "judge", "end")


def _is_class_with(found: object, methods: Iterable[str]) -> bool:
    return isinstance(found, type) and all(hasattr(found, name) for name in methods)


_DECODERS: Final = ExtensionGroup[Any](
    "tickrig.decoders",
    "decoder or rule",
    {},
    lambda found: _is_class_with(found, _DECODER) or _is_class_with(found, _RULE),
    "a class with `decode`, nor a check rule",
)


def make_decoder(eds: Mapping[int, EdsObjects], dbc: Sequence[Path] = ()) -> Decoder:
    """Return a decoder of CAN frames that first asks the decoders that installed packages provide.

    Args:
        eds: objects from the EDS of each node, by node-ID.
        dbc: DBC files that name further messages and signals.

    Raises:
        OSError: a DBC file cannot be read.
        DbcError: a DBC file is malformed, or cantools is not installed.
    """
    from tickrig.host.canmon.model.decode.decoder import Decoder  # noqa: PLC0415 - slow

    made: list[FrameDecoder] = []
    for name, found in _DECODERS.load_foreign(say).items():
        if _is_class_with(found, _DECODER):
            try:
                made.append(_CheckedDecoder(name, found()))
            except Exception as error:  # a foreign constructor may raise anything
                say(f"decoder {name!r}: {explain_error(error)}")
    return Decoder(eds, dbc, made)


def load_rule(name: str) -> Callable[[], Rule]:
    """Return the function that makes a rule of `canmon check`.

    The rule is one that an installed package adds.

    Raises:
        ExtensionError: no package has a rule of this name, or the rule cannot be used.
    """
    try:
        found = _DECODERS.load(name)
    except ExtensionError as error:
        switches = [f"--{rule.replace('_', '-')}" for rule in SWITCHES]
        hint = "".join(f"; did you mean {one}?" for one in closest(f"--{name}", switches))
        hint = hint or "; without a package it is as 'emcy never'"
        hint *= name not in _DECODERS.names()
        raise ExtensionError(f"{error}{hint}") from None
    if not _is_class_with(found, _RULE):
        raise ExtensionError(f"{name!r} is a decoder, no rule")

    def make() -> Rule:
        return _CheckedRule(name, _called(name, found))

    make()
    return make


class _CheckedDecoder:
    """A decoder of another package, which is left out after it has raised an error."""

    def __init__(self, name: str, decoder: FrameDecoder) -> None:
        self._name, self._decoder, self._broken = name, decoder, False

    def decode(self, record: Record) -> Decoded | None:
        if self._broken:
            return None
        try:
            return self._decoder.decode(record)
        except Exception as error:  # a foreign decoder may raise anything
            self._broken = True
            say(f"decoder {self._name!r} is left out: {explain_error(error)}")
            return None


class _CheckedRule(Rule):
    """A rule of another package. An error that the rule raises ends the command with one line."""

    def __init__(self, name: str, rule: Rule) -> None:
        self.name, self._rule = name, rule

    def wants(self, ident: int, /) -> bool:
        return bool(_called(self.name, self._rule.wants, ident))

    def selection(self, ident: int, /) -> FrameSelection:
        return _called(self.name, self._rule.selection, ident)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        return _called(self.name, self._rule.judge, record, gap_us)

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        return _called(self.name, lambda: list(self._rule.end(latest_us, end_us)))

    def begin(self, at_us: int, /) -> None:
        if isinstance(self._rule, Rule):
            _called(self.name, self._rule.begin, at_us)

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        known = isinstance(self._rule, Rule)
        return _called(self.name, self._rule.unjudged, evidence) if known else ""

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        known = isinstance(self._rule, Rule)
        return _called(self.name, lambda: list(self._rule.notes(evidence))) if known else ()


def _called(name: str, call: Callable[..., _T], *arguments: object) -> _T:
    try:
        return call(*arguments)
    except Exception as error:  # a foreign rule may raise anything
        raise Refused(f"rule {name!r}: {explain_error(error)}") from error
