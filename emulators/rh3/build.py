"""Build a base from the configuration that a trace carries, and the other way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any, Final

from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.record.trace import Config

NAME: Final = "rh3-base"


def config_to_trace(parameters: BaseParameters) -> Config:
    """Return all parameters, also those left alone: defaults may change one day."""
    settings = asdict(parameters)
    return {"ground_seed" if name == "seed" else name: v for name, v in settings.items()}


def build_rh3(config: Config) -> Rh3Base:
    """Build a base.

    Raises:
        ValueError: a parameter that a base does not have, or a value that it cannot have.
    """
    settings: dict[str, Any] = {
        key: value for key, value in config.items() if key != "seed"
    }  # of wire faults
    if "ground_seed" in settings:
        settings["seed"] = settings.pop("ground_seed")
    known = [field.name for field in fields(BaseParameters)]
    for name in settings:
        if name not in known:
            raise ValueError(f"a base has no parameter {name!r}; known: {', '.join(known)}")
    return Rh3Base(parameters_of(settings))


def parameters_of(settings: Mapping[str, Any]) -> BaseParameters:
    """Return parameters; ValueError for a value of another kind or out of range."""
    defaults = asdict(BaseParameters())
    for name, value in settings.items():
        wanted = (int,) if type(defaults[name]) is int else (int, float)
        if not (type(value) in wanted or (name == "friction" and value is None)):
            kind = "a whole number" if wanted == (int,) else "a number"
            raise ValueError(f"{name} is {value!r}, expected is {kind}")
    return BaseParameters(**settings)
