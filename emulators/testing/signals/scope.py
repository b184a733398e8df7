"""What the names in formulas mean: other signals, and inputs and outputs of devices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import nan
from typing import Final

from tickrig.device.physical import SignalType
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.signals.fields import SignalMistake
from tickrig.emulators.testing.signals.formula import Formula
from tickrig.emulators.testing.signals.sources import Constant, Integral, Lag, SignalSpec
from tickrig.host.text.names import near

_LONGEST: Final = 100
"""So many signals may need each other in a row."""

_TAKEN: Final = ("t", "pi")
"""What formulas name otherwise."""

SLASH: Final = "/"
"""Between the name of a device and that of its input or output."""


@dataclass(frozen=True, slots=True)
class DeviceSignal:
    """An input or output of a device.

    Attributes:
        device: the device.
        name: of its input or output.
    """

    device: HasSignals
    name: str

    @property
    def number(self) -> float:
        """Its present value; nan if that is a text."""
        value = read_signal(self.device, self.name)
        return nan if isinstance(value, str) else float(value)


class SignalScope:
    """The signals of a bench and its devices.

    Args:
        signals: by name; `DEVICE/INPUT` drives that input, any other name is for formulas.
        devices: by name.
    """

    def __init__(
        self, signals: Mapping[str, SignalSpec], devices: Mapping[str, HasSignals]
    ) -> None:
        self.signals, self.devices = signals, devices

    def find(self, name: str, owner: str) -> str | DeviceSignal | None:
        """Return what a name means: the name of a signal, something of a device, or None.

        Args:
            name: as a formula has it: a signal's, one of the owner's device, `DEVICE.NAME`,
                or in quotes `DEVICE/NAME`.
            owner: the signal that the formula is of.
        """
        own, slash, _ = owner.partition(SLASH)
        full = name if SLASH in name else name.replace(".", SLASH, 1)
        for key in (name, *([f"{own}{SLASH}{name}"] if slash else []), full):
            if key in self.signals:
                return key
            if (found := self.device_signal(key)) is not None:
                return found
        return None

    def device_signal(self, key: str) -> DeviceSignal | None:
        """Return the input or output `DEVICE/NAME`, None if there is none."""
        device_name, _, name = key.partition(SLASH)
        device = self.devices.get(device_name)
        if device is None or not (name in device.inputs.table or name in device.outputs):
            return None
        return DeviceSignal(device, name)

    def needed(self, key: str) -> Iterator[str]:
        """Yield the signals whose value of now a signal is computed of."""
        source = self.signals[key].source
        if isinstance(source, Formula):
            for name in source.names:
                if isinstance(found := self.find(name, key), str):
                    yield found

    def ordered(self) -> list[str]:
        """Return all signals, each behind those that it needs; ValueError if there is none."""
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


class _Order(ValueError):  # noqa: N818 - told as a mistake
    """Why there is no order: the reason, and the signal."""


def check_signals(
    signals: Mapping[str, SignalSpec], devices: Mapping[str, HasSignals]
) -> list[SignalMistake]:
    """Find what is wrong with signals on a bench: unknown names, values out of range, circles.

    Args:
        signals: by name; `DEVICE/INPUT` drives that input, any other name is for formulas.
        devices: by name.

    Returns:
        All mistakes; the first key of each is the name of its signal.
    """
    scope = SignalScope(signals, devices)
    mistakes = [mistake for key in signals for mistake in _check(scope, key)]
    if not mistakes:
        try:
            scope.ordered()
        except _Order as error:
            mistakes.append(SignalMistake((error.args[1],), str(error.args[0])))
    return mistakes


def _check(scope: SignalScope, key: str) -> Iterator[SignalMistake]:
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


def _near(scope: SignalScope, key: str, wanted: str) -> str:
    """Say what a formula could mean, or list what it could name, its own device first."""
    own = key.partition(SLASH)[0]
    names = [name for name in scope.signals if SLASH not in name]
    for name in sorted(scope.devices, key=lambda name: name != own):
        device, begin = scope.devices[name], "" if name == own else f"{name}."
        names += [f"{begin}{each}" for each in (*device.outputs, *device.inputs.table)]
    return near(wanted, names)


def _check_target(scope: SignalScope, key: str) -> Iterator[SignalMistake]:
    """Yield what is wrong with an input that is driven."""
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
