"""The base of RH3 as a device type: `rh3-emu`, and the configuration that its traces carry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any, Final

from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.commands.device_type import ConfiguredDevice, DeviceType, check_config
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rh3.base_options import parameters_of, read_parameters
from tickrig.emulators.rh3.frame_log import frame_splitter
from tickrig.emulators.rh3.verbs import verbs
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.host.text.trace import Config

CYCLE: Final = b"01 17 "
"""What -v leaves out: the traffic of each period."""


def config_to_trace(parameters: BaseParameters) -> Config:
    """Return all parameters, also those left alone: defaults may change one day."""
    settings = asdict(parameters)
    return {"ground_seed" if name == "seed" else name: v for name, v in settings.items()}


def build_rh3(config: Config) -> Rh3Base:
    """Build a base.

    Raises:
        ValueError: a parameter that a base does not have, or a value that it cannot have.
    """
    settings: dict[str, Any] = dict(config)
    if "ground_seed" in settings:
        settings["seed"] = settings.pop("ground_seed")
    check_config(settings, asdict(BaseParameters()), "a base has no parameter", typed=False)
    return Rh3Base(parameters_of(settings))


def _configure(base: DeviceType, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
    settings = dict(options)
    line = replace(base.line, baud=settings.pop("baud"))
    parameters = read_parameters({**settings, "seed": seed})
    address = parameters.address

    def talk(link: str, baud: int) -> str:
        return (
            f" Any Modbus RTU master can open this path, as address {address}."
            f" To address 1:\n  rh3 goto 1 0 0 --device {link} --baud {baud}"
        )

    base = replace(base, senders=verbs(address), line=line, talk=talk)
    return ConfiguredDevice(base, Rh3Base(parameters), config_to_trace(parameters))


def _is_event(line: WireLine) -> bool:
    return not line.data.startswith(CYCLE)


RH3_BASE: Final = DeviceType(
    name="rh3-base",
    title="RH3 base",
    build=build_rh3,
    configure=_configure,
    config_of=lambda base: config_to_trace(base.parameters),
    line=LineSettings(splitter=frame_splitter, wire=Rs485Line),
    is_event=_is_event,
)
