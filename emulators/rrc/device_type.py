"""The RRC as a device type: `rrc-emu`, and its configuration in traces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.settings import FailTarget, RrcConfig
from tickrig.emulators.commands.device_type import ConfiguredDevice, DeviceType, check_config
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rrc.fields import FIELDS
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.text.trace import Config, Mark
from tickrig.wire.rrc.message import check_digit

if TYPE_CHECKING:
    from tickrig.emulators.rrc import panel
else:
    panel = LazyModule("tickrig.emulators.rrc.panel")  # an extra

_EVENTS: Final = (b"EV:", b"ER:")


def _config_to_trace(config: RrcConfig) -> Config:
    """Return all settings, including unchanged ones, because defaults may change."""
    return {**asdict(config), "power_on_fail_target": config.power_on_fail_target.value}


def _build_rrc(config: Config) -> Rrc:
    """Build an RRC.

    Raises:
        ValueError: an RRC does not have the setting, or does not accept the value.
    """
    check_config(config, _config_to_trace(RrcConfig()), "an RRC has no setting")
    settings: dict[str, Any] = dict(config)
    if "power_on_fail_target" in settings:
        settings["power_on_fail_target"] = FailTarget(settings["power_on_fail_target"])
    return Rrc(RrcConfig(**settings))


def _configure(rrc: DeviceType, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
    config = RrcConfig(**options)
    return ConfiguredDevice(rrc, Rrc(config), _config_to_trace(config))


def _is_event(line: WireLine) -> bool:
    return line.mark is Mark.FROM_DEVICE and line.data.startswith(_EVENTS)


def _panel(emulator: Emulator) -> None:
    panel.run_panel(emulator)


RRC: Final = DeviceType(
    name="rrc",
    title="RRC",
    build=_build_rrc,
    fields=FIELDS,
    configure=_configure,
    config_of=lambda rrc: _config_to_trace(rrc.config),
    encoders={"check": lambda text: text + check_digit(text) + b"\n"},
    is_event=_is_event,
    panel=_panel,
)
