"""Component types that a manager finds by name: ours, and those of installed packages."""

from __future__ import annotations

from typing import Final

from tickrig.host.cli.extensions import ExtensionError, ExtensionGroup
from tickrig.host.rtc.component import ModuleSpec, RtComponent
from tickrig.host.rtc.states import RtcRefused

_HERE: Final = "tickrig.host.rtc.components"
_UCODE: Final = {
    "infrared_rays_reader": "InfraredRaysReader",
    "ucode_settlement": "UcodeSettlement",
    "contents_interpretation": "ContentsInterpretation",
}


def is_component_type(found: object) -> bool:
    """Return whether this is a class of components, one that can be registered."""
    return (
        isinstance(found, type)
        and issubclass(found, RtComponent)
        and isinstance(getattr(found, "spec", None), ModuleSpec)
    )


COMPONENT_TYPES: Final = ExtensionGroup[type[RtComponent]](
    "tickrig.components",
    "component type",
    {
        name: f"{_HERE}:{name}"
        for name in ("ConsoleIn", "ConsoleOut", "SeqIn", "SeqOut", "ConfigSample")
    }
    | {name: f"tickrig.host.rtc.ucode.{module}:{name}" for module, name in _UCODE.items()},
    is_component_type,
    "an RtComponent with a spec",
)
"""The entry-point group `tickrig.components` (docs/howto/extending.md)."""


def installed_type(name: str) -> type[RtComponent]:
    """Load one of them; RtcRefused if that fails, or if its class has another name."""
    try:
        found = COMPONENT_TYPES.load(name)
    except ExtensionError as error:
        raise RtcRefused(str(error)) from error
    if found.spec.type_name != name:
        raise RtcRefused(f"component type {name!r} calls itself {found.spec.type_name!r}")
    return found
