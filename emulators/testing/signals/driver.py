"""Drives inputs of devices by signals, as a coupling of their rig."""

from __future__ import annotations

from collections.abc import Mapping
from math import gcd, isfinite
from typing import Final

from tickrig.device.physical import InputSignal
from tickrig.device.twin import Copyable
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.testing.signals.formula import Formula
from tickrig.emulators.testing.signals.node import FilterNode, node_of
from tickrig.emulators.testing.signals.scope import SLASH, DeviceSignal, Scope, check_signals
from tickrig.emulators.testing.signals.signal_spec import Integral, Lag, SignalSpec
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.instant import NEVER

NO_DEVICE_US: Final = 1_000_000
"""The period of a driver that has no device."""


class SignalDriver(Copyable):
    """Sets inputs of devices to the values of their signals, when these change.

    At a time an input has the value that its signal had at the last tick up to then; a device
    sees it at its next tick, as it sees what a body does. Where an input takes whole numbers
    it has the nearest one, and it stays in its range. A value that is no number, as 0/0, leaves
    an input as it is. What is set by hand holds until the signal changes, or for good after
    `release`.

    Args:
        signals: by name; `DEVICE/INPUT` drives that input, any other name is for formulas.
        devices: by name.
        seed: of noise that has none of its own.

    Raises:
        ValueError: what `check_signals` finds.

    Attributes:
        tick_us: it acts at multiples of this, at which every tick of a device is.
        due_us: when a signal changes next by itself.
        problems: what a signal could not do, by its name, the first time that it happened.
    """

    def __init__(
        self,
        signals: Mapping[str, SignalSpec],
        devices: Mapping[str, HasSignals],
        seed: int = 0,
    ) -> None:
        if mistakes := check_signals(signals, devices):
            raise ValueError("; ".join(map(str, mistakes)))
        self.tick_us = gcd(*(device.tick_us for device in devices.values())) or NO_DEVICE_US
        self.problems: dict[str, str] = {}
        scope = Scope(signals, devices)
        self._nodes = {key: node_of(key, signals[key], seed) for key in scope.ordered()}
        self._link(scope)
        self._filters = [node for node in self._nodes.values() if isinstance(node, FilterNode)]
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

    def _link(self, scope: Scope) -> None:
        """Let each node find what its formula names."""
        for key, node in self._nodes.items():
            source = node.spec.source
            formula = source.formula if isinstance(source, Lag | Integral) else source
            for name in formula.names if isinstance(formula, Formula) else ():
                found = scope.find(name, key)
                term = self._nodes[found] if isinstance(found, str) else found
                node.terms = {**node.terms, name: term} if term else node.terms

    def act(self, now_us: int, /) -> None:
        """Take the values of now, and set the inputs whose value is another."""
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
        """Return the present value of a signal; KeyError if there is none of this name."""
        return self._nodes[name].setting

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all signals; those that drive an input are `DEVICE/INPUT`."""
        return tuple(self._nodes)

    def release(self, name: str) -> None:
        """Let an input be driven by hand from now on; one that no signal drives is no error."""
        self._targets.pop(name, None)


class _Target(Copyable):
    """An input that is driven."""

    __slots__ = ("_item", "_signal", "_value")

    def __init__(self, signal: DeviceSignal, item: InputSignal) -> None:
        self._signal, self._item = signal, item
        self._value: Setting | None = None

    def take(self, value: Setting) -> str:
        """Set the input to a value, if it is another; return why it stays as it is."""
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
