"""Build a node from the configuration that a trace carries, and the other way; find components."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from tickrig.device.rtc_lite.component import Component, Echo, LiteA, LiteB
from tickrig.device.rtc_lite.config import NodeConfig
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.emulators.record.trace import Config
from tickrig.host.text.user_file import SUFFIX, explain_error, find_class
from tickrig.wire.rtc_lite.codes import ContextType
from tickrig.wire.rtc_lite.frame import Checksum, Framing

NAME: Final = "rtc-lite"


def config_to_trace(node: str, config: NodeConfig) -> Config:
    """Return all settings, also those left alone: defaults may change one day."""
    return {
        "node": node,
        "framing": config.framing.value,
        "checksum": config.checksum.value,
        "context": config.context.name.lower(),
        "rate_hz": config.rate_hz,
        "slow_answer_us": config.slow_answer_us,
    }


def build_rtc_lite(config: Config) -> RtcLiteNode:
    """Build a node.

    Raises:
        ValueError: a setting that a node does not have, or a value that it cannot have.
    """
    defaults = config_to_trace("echo", NodeConfig())
    settings: dict[str, Any] = {**defaults, **config}
    settings.pop("seed", None)  # of the wire's faults: what came through is in the trace
    for name, value in settings.items():
        if name not in defaults:
            raise ValueError(f"a node has no setting {name!r}; known: {', '.join(defaults)}")
        if type(value) is not type(defaults[name]):
            raise ValueError(f"{name} is {value!r}, expected is something like {defaults[name]!r}")
    make = find_component(settings["node"])
    return RtcLiteNode(
        make,
        NodeConfig(
            Framing(settings["framing"]),
            Checksum(settings["checksum"]),
            _context(settings["context"]),
            settings["rate_hz"],
            settings["slow_answer_us"],
        ),
    )


def _context(name: str) -> ContextType:
    try:
        return ContextType[name.upper()]
    except KeyError:
        raise ValueError(f"context is {name!r}, proxy or timer is possible") from None


COMPONENTS: Final[Mapping[str, type[Component]]] = MappingProxyType(
    {"echo": Echo, "lite-a": LiteA, "lite-b": LiteB}
)


def find_component(spec: str) -> type[Component]:
    """Return the component that a name or `FILE.py:Class` stands for.

    Raises:
        ValueError: there is none, its file cannot be run, or no PIC has room for it.
    """
    if spec in COMPONENTS:
        return COMPONENTS[spec]
    if f"{SUFFIX}:" not in spec:
        raise ValueError(f"no node {spec!r}; known: {', '.join(COMPONENTS)}, or FILE.py:Class")
    kind: type[Component] = find_class(spec, Component)
    try:
        kind()
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {explain_error(error, spec.rpartition(':')[0])}") from None
    return kind
