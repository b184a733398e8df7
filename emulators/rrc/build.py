"""Build an RRC from the configuration that a trace carries, and the other way."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

from tickrig.device.rrc.config import FailTarget, RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.record.trace import Config

NAME: Final = "rrc"


def config_to_trace(config: RrcConfig) -> Config:
    """Return all settings, also those left alone: defaults may change one day."""
    return {**asdict(config), "power_on_fail_target": config.power_on_fail_target.value}


def build_rrc(config: Config) -> Rrc:
    """Build an RRC.

    Raises:
        ValueError: a setting that an RRC does not have, or a value that it cannot have.
    """
    settings: dict[str, Any] = dict(config)
    settings.pop("seed", None)  # of the wire's faults: what came through is in the trace
    defaults = config_to_trace(RrcConfig())
    for name, value in settings.items():
        if name not in defaults:
            raise ValueError(f"an RRC has no setting {name!r}; known: {', '.join(defaults)}")
        if type(value) is not type(defaults[name]):
            raise ValueError(f"{name} is {value!r}, expected is something like {defaults[name]!r}")
    if "power_on_fail_target" in settings:
        settings["power_on_fail_target"] = FailTarget(settings["power_on_fail_target"])
    return Rrc(RrcConfig(**settings))
