"""Signals that run: each has a value of now, and knows when it may have another."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from math import isfinite, isnan, nan

from tickrig.device.twin import Copyable
from tickrig.emulators.testing.signals.formula import TIME, Formula
from tickrig.emulators.testing.signals.scope import DeviceSignal
from tickrig.emulators.testing.signals.signal_spec import Integral, Lag, SignalSpec
from tickrig.emulators.testing.signals.sources import Noise, Source
from tickrig.host.text.values import Setting
from tickrig.wire.instant import NEVER


class Node(Copyable):
    """A signal that runs.

    Args:
        spec: what it is.

    Attributes:
        setting: its value; nan where there is none.
        due_us: the earliest time at which it may have another by itself.
        terms: what the names of its formula mean.
    """

    __slots__ = ("due_us", "setting", "spec", "terms")

    def __init__(self, spec: SignalSpec) -> None:
        self.spec, self.due_us = spec, 0
        self.setting: Setting = nan
        self.terms: Mapping[str, Node | DeviceSignal] = {}

    @property
    def number(self) -> float:
        """Its value; nan if that is a text."""
        return nan if isinstance(self.setting, str) else self.setting

    @abstractmethod
    def update(self, now_us: int) -> None:
        """Take the value of now; all that it is computed of has done so before."""

    def evaluate(self, formula: Formula, now_us: int) -> float:
        """Return the value of its formula."""
        values = {name: term.number for name, term in self.terms.items()}
        return formula.value({**values, TIME: now_us / 1e6})


class TimeNode(Node):
    """A signal that depends on time alone."""

    __slots__ = ("source",)

    def __init__(self, spec: SignalSpec, source: Source) -> None:
        super().__init__(spec)
        self.source = source

    def update(self, now_us: int) -> None:
        """Take the value of now."""
        if now_us < self.due_us:
            return
        spec, at_us = self.spec, max(0, now_us - self.spec.from_us)
        if spec.every_us:
            at_us -= at_us % spec.every_us
        self.setting = spec.shaped(self.source.value(at_us))
        next_us = self.source.next_us(at_us)
        if spec.every_us:
            next_us = -(-next_us // spec.every_us) * spec.every_us
        self.due_us = min(NEVER, next_us + spec.from_us)


class FormulaNode(Node):
    """A signal that is computed of others."""

    __slots__ = ("formula",)

    def __init__(self, spec: SignalSpec, formula: Formula) -> None:
        super().__init__(spec)
        self.formula = formula

    def update(self, now_us: int) -> None:
        """Take the value of now, or hold that of before."""
        every_us = self.spec.every_us
        if every_us:
            if now_us < self.due_us:
                return
            self.due_us = now_us - now_us % every_us + every_us
        else:
            self.due_us = now_us + 1 if self.formula.timed else NEVER
        self.setting = self.spec.shaped(self.evaluate(self.formula, now_us))


class FilterNode(Node):
    """A signal with a memory: it moves each `every_us`, as what moves it was before."""

    __slots__ = ("_gain", "_input", "_moves", "_state", "filter")

    def __init__(self, spec: SignalSpec, source: Lag | Integral) -> None:
        super().__init__(spec)
        self.filter, self._gain = source, source.gain(spec.every_us)
        self._state, self._input, self._moves = nan, nan, 0
        if source.start is not None:
            self._state = self._limited(source.start)
        self.setting = spec.shaped(self._state)

    def update(self, now_us: int) -> None:
        """Make the moves up to now."""
        moves = now_us // self.spec.every_us
        for _ in range(moves - self._moves):
            if (state := self._next()) == self._state or isnan(state):
                break
            self._state = state
        self._moves = moves
        self.setting = self.spec.shaped(self._state)

    def observe(self, now_us: int) -> None:
        """Look at what moves it."""
        self._input = self.evaluate(self.filter.formula, now_us)
        if isnan(self._state) and isfinite(self._input):  # a lag that begins where its source is
            self._state = self._limited(self._input)
            self.setting = self.spec.shaped(self._state)
        moving = not isnan(self._state) and self._next() != self._state
        self.due_us = (self._moves + 1) * self.spec.every_us if moving else NEVER
        if self.filter.formula.timed:
            self.due_us = min(self.due_us, now_us + 1)

    def _next(self) -> float:
        if not isfinite(self._input):
            return self._state
        return self._limited(self.filter.moved(self._state, self._input, self._gain))

    def _limited(self, value: float) -> float:
        return min(max(value, self.spec.low), self.spec.high)


def node_of(name: str, spec: SignalSpec, seed: int) -> Node:
    """Return a signal that runs.

    Args:
        name: of the signal: noise of another name is independent.
        spec: what it is.
        seed: of its noise, unless it has one of its own.
    """
    source = spec.source
    if isinstance(source, Formula):
        return FormulaNode(spec, source)
    if isinstance(source, Lag | Integral):
        return FilterNode(spec, source)
    if isinstance(source, Noise):
        chosen = seed if source.seed is None else source.seed
        source = replace(source, seed=chosen, stream=name)
    return TimeNode(spec, source)
