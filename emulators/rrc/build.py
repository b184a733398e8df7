"""Build an RRC from the configuration that a trace carries, and the other way."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import Any, Final

from tickrig.device.rrc.config import FailTarget, RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.trace import Config

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
    known = {item.name for item in fields(RrcConfig)}
    if unknown := [name for name in settings if name not in known]:
        raise ValueError(f"an RRC has no setting {unknown[0]!r}; known: {', '.join(sorted(known))}")
    if "power_on_fail_target" in settings:
        settings["power_on_fail_target"] = FailTarget(settings["power_on_fail_target"])
    return Rrc(RrcConfig(**settings))
