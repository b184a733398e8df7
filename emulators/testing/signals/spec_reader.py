"""Signals in TOML: a number, a text, or a table such as `{ramp = [12.0, 9.5], over = "10s"}`.

>>> read_signal_spec({"ramp": [12.0, 9.5], "over": "10s"}).source.value(5_000_000)
10.75
>>> for mistake in read_signal_spec({"ramp": [12.0], "ower": "10s"}, ("supply_v",)):
...     print(mistake)
supply_v.ramp: it takes two numbers, as [0, 5], not [12.0]
supply_v.ower: not a key of ramp; did you mean 'over'?
supply_v.over: it is missing
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, Final

from tickrig.emulators.testing.signals import sources
from tickrig.emulators.testing.signals.table import read_table
from tickrig.host.text.names import near
from tickrig.host.text.section import anything, flag, text

_EVERY_US: Final = 10_000
"""Default interval at which noise is drawn, and lags and integrals advance."""

_Fields = Mapping[str, Any]
"""Values by key of a table, as the readers have converted them."""

_Reader = Callable[[object], object]
"""Function that converts a TOML value to a field; a ValueError says which values are allowed."""

_COMMON: Final[Mapping[str, _Reader]] = {
    "every": sources.some_time,
    "min": sources.number,
    "max": sources.number,
    "step": sources.step,
}
_FROM: Final[Mapping[str, _Reader]] = {"from": sources.time, **_COMMON}


@dataclass(frozen=True, slots=True)
class _Form:
    """A form of a signal as a table.

    Attributes:
        keys: possible keys. The first key identifies the form.
        build: function that makes the source from its fields. It raises ValueError if they do not
            match.
        needed: required keys.
        every_us: time for which a value is held, if there is no key `every`.
    """

    keys: Mapping[str, _Reader]
    build: Callable[[Path, _Fields], Any]
    needed: tuple[str, ...] = ()
    every_us: int = 0


def _ramp(folder: Path, fields: _Fields) -> sources.RampSource:
    first, last = fields["ramp"]
    return sources.RampSource(first, last, fields["over"], fields.get("repeat", False))


def _wave(shape: str, folder: Path, fields: _Fields) -> sources.Wave:
    (first, second), period_us = fields[shape], fields["period"]
    phase_us = round(fields.get("phase_deg", 0) / 360 * period_us)
    return sources.Wave(shape, first, second, period_us, phase_us, fields.get("duty", 0.5))


def _noise(folder: Path, fields: _Fields) -> sources.Noise:
    given, mean = fields["noise"], fields.get("mean")
    if uniform := isinstance(given, tuple):
        if mean is not None:
            raise ValueError("mean belongs to gaussian noise, as {noise = 0.1, mean = 12.0}")
        first, second = given
    else:
        first, second = mean or 0.0, given
    return sources.Noise(first, second, uniform, fields.get("every", _EVERY_US), fields.get("seed"))


def _formula(folder: Path, fields: _Fields) -> object:
    return fields["formula"]


def _lag(folder: Path, fields: _Fields) -> sources.Lag:
    return sources.Lag(fields["lag"], fields["tau"], fields.get("start"))


def _integral(folder: Path, fields: _Fields) -> sources.Integral:
    return sources.Integral(fields["integral"], fields.get("start", 0.0))


FORMS: Final[Mapping[str, _Form]] = {
    "ramp": _Form(
        {"ramp": sources.pair, "over": sources.some_time, "repeat": flag, **_FROM}, _ramp, ("over",)
    ),
    **{
        shape: _Form(
            {shape: sources.pair, "period": sources.some_time, "phase_deg": sources.number}
            | ({"duty": sources.part} if shape == "square" else {})
            | dict(_FROM),
            partial(_wave, shape),
            ("period",),
        )
        for shape in sources.SHAPES
    },
    "noise": _Form(
        {"noise": sources.spread, "mean": sources.number, "seed": sources.seed, **_FROM},
        _noise,
        every_us=_EVERY_US,
    ),
    "table": _Form(
        {"table": anything, "column": text, "interpolation": text, "repeat": flag} | dict(_FROM),
        read_table,
    ),
    "formula": _Form({"formula": sources.formula, **_COMMON}, _formula),
    "lag": _Form(
        {"lag": sources.formula, "tau": sources.some_time, "start": sources.number, **_COMMON},
        _lag,
        ("tau",),
        _EVERY_US,
    ),
    "integral": _Form(
        {"integral": sources.formula, "start": sources.number, **_COMMON},
        _integral,
        every_us=_EVERY_US,
    ),
}
"""Forms of a signal, by the key that identifies the form."""


def read_signal_spec(
    value: object, keys: sources.Keys = (), folder: Path | None = None
) -> sources.SignalSpec | list[sources.SignalMistake]:
    """Read the description of a signal from its TOML value in a rig file.

    Whether the signals named in a formula exist is checked later, by `check_signals`.

    Args:
        value: number, true or false, text, or table (docs/reference/bench/signals.md).
        keys: keys that lead to the value in the file, for error messages.
        folder: folder of files with tables of values. The default is the working directory.

    Returns:
        The signal, or all mistakes in it.
    """
    if isinstance(value, bool | int | float | str):
        try:
            return sources.SignalSpec(
                sources.Constant(value if isinstance(value, str) else sources.number(value))
            )
        except ValueError as error:
            return [sources.SignalMistake(keys, str(error))]
    names = [name for name in FORMS if isinstance(value, dict) and name in value]
    if not isinstance(value, dict) or len(names) != 1:
        came = " and ".join(names) if names else f"{value!r:.60}"
        wanted = f"a number, a text, or a table with one of {', '.join(FORMS)}"
        return [sources.SignalMistake(keys, f"it is {wanted}; not {came}")]
    return _read(names[0], value, keys, folder or Path())


def _read(
    name: str, table: _Fields, keys: sources.Keys, folder: Path
) -> sources.SignalSpec | list[sources.SignalMistake]:
    form, fields = FORMS[name], dict[str, Any]()
    mistakes = [*_read_fields(name, table, keys, fields)]
    mistakes += [
        sources.SignalMistake((*keys, key), "it is missing")
        for key in form.needed
        if key not in table
    ]
    if not mistakes:
        try:
            return sources.SignalSpec(
                form.build(folder, fields),
                fields.get("from", 0),
                fields.get("every", form.every_us),
                **_limits(fields),
            )
        except ValueError as error:
            mistakes.append(sources.SignalMistake((*keys, name), str(error)))
    return mistakes


def _read_fields(
    name: str, table: _Fields, keys: sources.Keys, fields: dict[str, Any]
) -> Iterator[sources.SignalMistake]:
    """Store the fields; yield the mistakes in them."""
    known = FORMS[name].keys
    for key, value in table.items():
        if key not in known:
            hint = near(str(key), [other for other in known if other != name])
            yield sources.SignalMistake((*keys, key), f"not a key of {name}; {hint}")
            continue
        try:
            fields[key] = known[key](value)
        except ValueError as error:
            yield sources.SignalMistake((*keys, key), str(error))


def _limits(fields: _Fields) -> dict[str, float]:
    """Return limits and quantisation; raise ValueError if no value is between the limits."""
    named = {"min": "low", "max": "high", "step": "step"}
    limits = {named[key]: float(fields[key]) for key in named if key in fields}
    if limits.get("low", -inf) > limits.get("high", inf):
        raise ValueError(f"min {limits['low']:g} is above max {limits['high']:g}")
    return limits
