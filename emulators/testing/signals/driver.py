"""Drives inputs of devices by signals, as a coupling of their rig."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import gcd, isfinite, isnan, nan
from typing import Final

from tickrig.device.physical import InputSignal, SignalType
from tickrig.device.twin import Copyable
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.signals.formula import TIME, Formula
from tickrig.emulators.testing.signals.sources import (
    Constant,
    Integral,
    Lag,
    Noise,
    SignalMistake,
    SignalSource,
    SignalSpec,
)
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.instant import NEVER

# What the names in formulas mean: other signals, and inputs and outputs of devices.

_LONGEST: Final = 100
"""Largest length of a chain of signals in which each signal needs the next one."""

_TAKEN: Final = ("t", "pi")
"""Names that have another meaning in formulas."""

SLASH: Final = "/"
"""Separator between the name of a device and the name of its input or output."""


@dataclass(frozen=True, slots=True)
class _DeviceSignal:
    """An input or output of a device.

    Attributes:
        device: the device.
        name: name of the input or output.
    """

    device: HasSignals
    name: str

    @property
    def number(self) -> float:
        """The present value as a number, or nan if it is a text."""
        value = read_signal(self.device, self.name)
        return nan if isinstance(value, str) else float(value)


class _SignalScope:
    """The signals of a bench and its devices.

    Args:
        signals: signals by name. `DEVICE/INPUT` drives that input, and any other name is for
            formulas.
        devices: devices by name.
    """

    def __init__(
        self, signals: Mapping[str, SignalSpec], devices: Mapping[str, HasSignals]
    ) -> None:
        self.signals, self.devices = signals, devices

    def find(self, name: str, owner: str) -> str | _DeviceSignal | None:
        """Return the signal, input or output that a name in a formula means, or None if unknown.

        A signal is returned as its name. Otherwise the result is an input or output of a device.

        Args:
            name: name as in a formula: a signal, `DEVICE.NAME`, or `DEVICE/NAME` in quotes. If
                `owner` is `DEVICE/INPUT`, the name may also be an input or output of this device.
            owner: signal that has the formula: `DEVICE/INPUT` if the signal sets an input of a
                device, otherwise the name of the signal.
        """
        own, slash, _ = owner.partition(SLASH)
        full = name if SLASH in name else name.replace(".", SLASH, 1)
        for key in (name, *([f"{own}{SLASH}{name}"] if slash else []), full):
            if key in self.signals:
                return key
            if (found := self.device_signal(key)) is not None:
                return found
        return None

    def device_signal(self, key: str) -> _DeviceSignal | None:
        """Return the input or output `DEVICE/NAME`, or None if there is none."""
        device_name, _, name = key.partition(SLASH)
        device = self.devices.get(device_name)
        if device is None or not (name in device.inputs.table or name in device.outputs):
            return None
        return _DeviceSignal(device, name)

    def needed(self, key: str) -> Iterator[str]:
        """Yield the signals whose present values a signal needs."""
        source = self.signals[key].source
        if isinstance(source, Formula):
            for name in source.names:
                if isinstance(found := self.find(name, key), str):
                    yield found

    def ordered(self) -> list[str]:
        """Return all signals, each after those that it needs; raise ValueError if impossible."""
        order: dict[str, None] = {}
        for key in self.signals:
            self._enter(key, (), order)
        return list(order)

    def _enter(self, key: str, path: tuple[str, ...], order: dict[str, None]) -> None:
        if key in order:
            return
        if len(path) == _LONGEST:
            raise _Order(f"it needs more than {_LONGEST} others in a row", path[0])
        if key in path:
            circle = (*path[path.index(key) :], key)
            raise _Order(f"a circle: {' -> '.join(circle)}", key)
        for other in self.needed(key):
            self._enter(other, (*path, key), order)
        order[key] = None


class _Order(ValueError):  # noqa: N818 - reported as a mistake
    """An error in the order of signals: the reason, and the signal."""


def check_signals(
    signals: Mapping[str, SignalSpec], devices: Mapping[str, HasSignals]
) -> list[SignalMistake]:
    """Return all mistakes in the signals of a bench.

    These are unknown names, values out of range and circular references.

    Args:
        signals: signals by name. A signal named `DEVICE/INPUT` drives that input; any other name is
            for use in formulas.
        devices: inputs and outputs of the devices, by name of the device.

    Returns:
        All mistakes. The first key of a mistake is the name of the signal.
    """
    scope = _SignalScope(signals, devices)
    mistakes = [mistake for key in signals for mistake in _check(scope, key)]
    if not mistakes:
        try:
            scope.ordered()
        except _Order as error:
            mistakes.append(SignalMistake((error.args[1],), str(error.args[0])))
    return mistakes


def _check(scope: _SignalScope, key: str) -> Iterator[SignalMistake]:
    if SLASH in key:
        yield from _check_target(scope, key)
    if key in _TAKEN:
        yield SignalMistake(
            (key,), f"no signal can be called so: in formulas {key} is something else"
        )
    source = scope.signals[key].source
    if isinstance(source, Lag | Integral):
        source = source.formula
    if isinstance(source, Formula):
        for name in source.names:
            if scope.find(name, key) is None:
                yield SignalMistake(
                    (key,), f"no signal, input or output {name}; {_near(scope, key, name)}"
                )


def _near(scope: _SignalScope, key: str, wanted: str) -> str:
    """Return similar names, or the names that a formula may use, those of its own device first."""
    own = key.partition(SLASH)[0]
    names = [name for name in scope.signals if SLASH not in name]
    for name in sorted(scope.devices, key=lambda name: name != own):
        device, begin = scope.devices[name], "" if name == own else f"{name}."
        names += [f"{begin}{each}" for each in (*device.outputs, *device.inputs.table)]
    return near(wanted, names)


def _check_target(scope: _SignalScope, key: str) -> Iterator[SignalMistake]:
    """Yield the errors of an input that a signal drives."""
    device_name, _, name = key.partition(SLASH)
    device = scope.devices.get(device_name)
    if device is None:
        yield SignalMistake((key,), f"no device {device_name}; {near(device_name, scope.devices)}")
        return
    if name not in device.inputs.table:
        yield SignalMistake((key,), f"no input {name}; {near(name, device.inputs.table)}")
        return
    spec, item = scope.signals[key], device.inputs.table[name]
    try:
        if isinstance(spec.source, Constant):
            device.inputs.check(name, spec.shaped(spec.source.setting))
            return
        if item.type is SignalType.TEXT:
            raise ValueError(f"{name} takes a text, and only a text that stays drives it")
        device.inputs.check(name, item.initial)
    except ValueError as error:
        yield SignalMistake((key,), str(error))
        return
    if isinstance(spec.source, Formula | Lag | Integral):
        return
    for value in map(spec.shaped, spec.source.ends):
        if not isinstance(value, str) and not item.low <= value <= item.high:
            unit = f" {item.unit}" if item.unit else ""
            yield SignalMistake(
                (key,), f"it reaches {value:g}, and {name} takes {item.low}..{item.high}{unit}"
            )


# Signals that run: each has a value of now, and knows when it may have another.


# Theory of operation
# ===================
#
# Signals are a graph of three kinds of nodes:
#
# - sources of time: ramp, wave, noise, table
# - formulas of other signals and of the inputs and outputs of devices
# - filters with a memory: lag, integral
#
# `SignalDriver` evaluates the graph at the ticks of the rig, and sets inputs whose value has
# changed. It is a coupling: the rig calls `act` between the ticks of devices, and a device sees an
# input at its next tick.
#
# One evaluation has three passes, in this order:
#
# 1. filters advance to the current time, with the values observed before
# 2. all others get their current value, each after those that it needs (`SignalScope.ordered`)
# 3. filters observe their sources (`observe`)
#
# A filter is therefore one step behind its source, which makes cycles through a filter possible: a
# formula may use a lag that follows the formula. Cycles without a filter are refused.
#
# Values must not depend on how often they are read. Sources of time are pure functions of time.
# Noise is drawn by number and not in order. A filter advances in steps of `every_us` regardless of
# the ticks. `due_us` is the earliest time at which a value may change: it may be too early, but
# never too late. A rig that jumps to `due_us` sees the same values as one that runs every tick.
#
# At the start the graph is evaluated once more than there are filters. The reason is that a lag
# without a start begins at the value of its source, which may be another lag.
#
# An input that was set by hand keeps that value until its signal changes, because `_Target`
# compares with the last value of the signal and not with the input. A value of nan does not change
# an input, and is reported once.


class _RunningSignal(Copyable):
    """A signal while the bench runs.

    Args:
        spec: specification of the signal.

    Attributes:
        setting: value of the signal, or nan if it has no value.
        due_us: earliest time of another value, if no other signal changes.
        terms: objects of the names in the formula.
    """

    __slots__ = ("due_us", "setting", "spec", "terms")

    def __init__(self, spec: SignalSpec) -> None:
        self.spec, self.due_us = spec, 0
        self.setting: Setting = nan
        self.terms: Mapping[str, _RunningSignal | _DeviceSignal] = {}

    @property
    def number(self) -> float:
        """The value as a number, or nan if it is a text."""
        return nan if isinstance(self.setting, str) else self.setting

    @abstractmethod
    def update(self, now_us: int) -> None:
        """Compute the present value; the signals in the formula were updated before."""

    def evaluate(self, formula: Formula, now_us: int) -> float:
        """Return the value of a formula."""
        values = {name: term.number for name, term in self.terms.items()}
        return formula.value({**values, TIME: now_us / 1e6})


class _TimeNode(_RunningSignal):
    """A signal that depends only on time."""

    __slots__ = ("source",)

    def __init__(self, spec: SignalSpec, source: SignalSource) -> None:
        super().__init__(spec)
        self.source = source

    def update(self, now_us: int) -> None:
        """Compute the present value."""
        if now_us < self.due_us:
            return
        spec, at_us = self.spec, max(0, now_us - self.spec.from_us)
        if spec.every_us:
            at_us -= at_us % spec.every_us
        self.setting = spec.shaped(self.source.value(at_us))
        next_us = self.source.next_us(at_us)
        if spec.every_us:
            next_us = -(-next_us // spec.every_us) * spec.every_us
        # `from_us` shifts the source; `every_us` rounds the next change up to its grid.
        self.due_us = min(NEVER, next_us + spec.from_us)


class _FormulaNode(_RunningSignal):
    """A signal that is computed from other signals."""

    __slots__ = ("formula",)

    def __init__(self, spec: SignalSpec, formula: Formula) -> None:
        super().__init__(spec)
        self.formula = formula

    def update(self, now_us: int) -> None:
        """Compute the present value, or hold the previous value."""
        every_us = self.spec.every_us
        if every_us:
            if now_us < self.due_us:
                return
            self.due_us = now_us - now_us % every_us + every_us
        else:
            self.due_us = now_us + 1 if self.formula.timed else NEVER
        self.setting = self.spec.shaped(self.evaluate(self.formula, now_us))


class _FilterNode(_RunningSignal):
    """A signal with a memory; it moves every `every_us`, by the previous value of its formula."""

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
        """Store the present value of the formula, for the next moves of the signal."""
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


def _node_of(name: str, spec: SignalSpec, seed: int) -> _RunningSignal:
    """Return a signal for a running bench.

    Args:
        name: name of the signal. Signals with different names have independent noise.
        spec: specification of the signal.
        seed: seed of the noise, if the specification has none.
    """
    source = spec.source
    if isinstance(source, Formula):
        return _FormulaNode(spec, source)
    if isinstance(source, Lag | Integral):
        return _FilterNode(spec, source)
    if isinstance(source, Noise):
        chosen = seed if source.seed is None else source.seed
        source = replace(source, seed=chosen, stream=name)
    return _TimeNode(spec, source)


_NO_DEVICE_US: Final = 1_000_000
"""The period of a driver that has no device."""


class SignalDriver(Copyable):
    """Sets inputs of devices to the values of their signals when these change.

    An input gets the value that its signal had at the last tick up to now. A device sees the value
    at its next tick, as it sees the changes made by a body. An input for whole numbers gets the
    nearest whole number. Values are limited to the range of the input. A value that is not a
    number, such as 0/0, leaves the input unchanged. A value set by hand holds until the signal
    changes, or permanently after `release`.

    Args:
        signals: signals by name. `DEVICE/INPUT` drives that input, and any other name is for
            formulas.
        devices: devices by name.
        seed: seed of noise that has no seed of its own.

    Raises:
        ValueError: `check_signals` has found mistakes.

    Attributes:
        tick_us: period of the signals, which change at its multiples. Every tick of a device is at
            such a multiple.
        due_us: time of the next change of a signal.
        problems: first problems of signals, by name of the signal.
    """

    def __init__(
        self,
        signals: Mapping[str, SignalSpec],
        devices: Mapping[str, HasSignals],
        seed: int = 0,
    ) -> None:
        if mistakes := check_signals(signals, devices):
            raise ValueError("; ".join(map(str, mistakes)))
        self.tick_us = gcd(*(device.tick_us for device in devices.values())) or _NO_DEVICE_US
        self.problems: dict[str, str] = {}
        scope = _SignalScope(signals, devices)
        self._nodes = {key: _node_of(key, signals[key], seed) for key in scope.ordered()}
        self._link(scope)
        self._filters = [node for node in self._nodes.values() if isinstance(node, _FilterNode)]
        self._others = [node for node in self._nodes.values() if node not in self._filters]
        self._targets = {
            key: _Target(found, found.device.inputs.table[found.name])
            for key in signals
            if SLASH in key and (found := scope.device_signal(key)) is not None
        }
        self.due_us = 0
        for _ in range(len(self._filters) + 1):  # a lag begins where its source does
            for node in self._nodes.values():
                node.due_us = 0
            self.problems.clear()
            self.act(0)

    def _link(self, scope: _SignalScope) -> None:
        """Find the objects of the names in all formulas."""
        for key, node in self._nodes.items():
            source = node.spec.source
            formula = source.formula if isinstance(source, Lag | Integral) else source
            for name in formula.names if isinstance(formula, Formula) else ():
                found = scope.find(name, key)
                term = self._nodes[found] if isinstance(found, str) else found
                node.terms = {**node.terms, name: term} if term else node.terms

    def act(self, now_us: int, /) -> None:
        """Compute the present values, and set the inputs whose values have changed."""
        for node in self._filters:
            node.update(now_us)
        for other in self._others:
            other.update(now_us)
        for node in self._filters:
            node.observe(now_us)
        for key, target in self._targets.items():
            if (problem := target.take(self._nodes[key].setting)) and key not in self.problems:
                self.problems[key] = f"{key}: {problem} at {format_time(now_us)} s"
        self.due_us = min((node.due_us for node in self._nodes.values()), default=NEVER)

    def value(self, name: str) -> Setting:
        """Return the current value of a signal; raise KeyError if the name is unknown."""
        return self._nodes[name].setting

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all signals; a signal that drives an input is named `DEVICE/INPUT`."""
        return tuple(self._nodes)

    def release(self, name: str) -> None:
        """Stop driving an input by its signal; do nothing if no signal drives it.

        Args:
            name: name of the input as `DEVICE/INPUT`.
        """
        self._targets.pop(name, None)


class _Target(Copyable):
    """An input that is driven."""

    __slots__ = ("_item", "_signal", "_value")

    def __init__(self, signal: _DeviceSignal, item: InputSignal) -> None:
        self._signal, self._item = signal, item
        self._value: Setting | None = None

    def take(self, value: Setting) -> str:
        """Set the input to a new value of its signal; return an error message, or ""."""
        if not isinstance(value, str):
            value = min(max(value, self._item.low), self._item.high)
            if not isfinite(value):
                return f"{value} is no value"
            value = value if self._item.real else round(value)
        if value != self._value:
            self._value = value
            try:
                self._signal.device.inputs.set(self._signal.name, value)
            except ValueError as error:
                return str(error)
        return ""
