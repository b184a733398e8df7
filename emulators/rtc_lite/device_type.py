"""The RTC-Lite node as a device type: `rtc-lite-emu`, and its configuration in traces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from tickrig.device.rtc_lite.component import LiteA, LiteB, LiteComponent, LiteEcho
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import DEFAULT_RATE_HZ, LiteConfig
from tickrig.emulators.commands.device_type import ConfiguredDevice, DeviceType, check_config
from tickrig.emulators.fields import named
from tickrig.emulators.rtc_lite.fields import FIELDS
from tickrig.emulators.rtc_lite.line import LINE_FAULTS, frame_splitter, verbs
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.host.text.names import near
from tickrig.host.text.trace import Config
from tickrig.host.text.user_file import SUFFIX, explain_error, find_class
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteContextType
from tickrig.wire.rtc_lite.frame import Checksum, Framing

_ROUTINE: Final = tuple(
    command.value
    for command in (
        LiteCommand.PING,
        LiteCommand.EXECUTE,
        LiteCommand.ERROR,
        LiteCommand.WRITE,
        LiteCommand.DATA,
    )
)
"""Periodic traffic, which -v omits."""


def _config_to_trace(node: str, config: LiteConfig) -> Config:
    """Return all settings, including unchanged ones, because defaults may change."""
    return {
        "node": node,
        "framing": config.framing.value,
        "checksum": config.checksum.value,
        "context": config.context.name.lower(),
        "rate_hz": config.rate_hz,
        "slow_answer_us": config.slow_answer_us,
    }


def _build_rtc_lite(config: Config) -> RtcLiteNode:
    """Build a node.

    Raises:
        ValueError: a node does not have the setting, or does not accept the value.
    """
    defaults = _config_to_trace("echo", LiteConfig())
    check_config(config, defaults, "a node has no setting")
    settings: dict[str, Any] = {**defaults, **config}
    return RtcLiteNode(
        _find_component(settings["node"]),
        LiteConfig(
            Framing(settings["framing"]),
            Checksum(settings["checksum"]),
            _context(settings["context"]),
            settings["rate_hz"],
            settings["slow_answer_us"],
        ),
    )


def _context(name: str) -> LiteContextType:
    try:
        return LiteContextType[name.upper()]
    except KeyError:
        raise ValueError(f"context is {name!r}, proxy or timer is possible") from None


COMPONENTS: Final[Mapping[str, type[LiteComponent]]] = MappingProxyType(
    {"echo": LiteEcho, "lite-a": LiteA, "lite-b": LiteB}
)


def _find_component(spec: str) -> type[LiteComponent]:
    """Return the component with a name, or the component of a `FILE.py:Class`.

    Raises:
        ValueError: the name is unknown, the file cannot be run, or the component does not fit into
            a PIC.
    """
    if spec in COMPONENTS:
        return COMPONENTS[spec]
    if f"{SUFFIX}:" not in spec:
        raise ValueError(f"no node {spec!r}; {near(spec, COMPONENTS)} (or FILE.py:Class)")
    kind: type[LiteComponent] = find_class(spec, LiteComponent)
    try:
        kind()
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {explain_error(error, spec.rpartition(':')[0])}") from None
    return kind


def _configure(lite: DeviceType, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
    node, timer_hz = options["node"], options["timer_hz"]
    with named("--checksum"):
        config = LiteConfig(
            Framing(options["framing"]),
            Checksum(options["checksum"]),
            LiteContextType.TIMER if timer_hz else LiteContextType.PROXY,
            timer_hz or DEFAULT_RATE_HZ,
        )
    with named("--node"):
        device = RtcLiteNode(_find_component(node), config)
    lite = replace(
        lite,
        title=f"{lite.title} {device.component.type_name}",
        senders=verbs(device.component, config),
        line=LineSettings(options["baud"], LINE_FAULTS, frame_splitter(config)),
        user_code="" if node in COMPONENTS else node,
    )
    return ConfiguredDevice(lite, device, _config_to_trace(node, config))


def _config_of(lite: RtcLiteNode) -> Config | None:
    names = [name for name, kind in COMPONENTS.items() if kind is lite.make]
    return _config_to_trace(names[0], lite.config) if names else None


def _talk(link: str, baud: int) -> str:
    return f" Its proxy opens this path:\n  tickrig rtc run SYSTEM.toml --lite NAME={link}@{baud}"


RTC_LITE: Final = DeviceType(
    name="rtc-lite",
    title="RTC-Lite node",
    build=_build_rtc_lite,
    fields=FIELDS,
    configure=_configure,
    config_of=_config_of,
    is_event=lambda line: line.data[:2] not in _ROUTINE,
    talk=_talk,
)
