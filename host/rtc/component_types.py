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
_MOTION: Final[dict[str, str]] = {
    "RefHardRh3": "components.ref_hard:RefHardRh3",
    "Odometry": "components.odometry:Odometry",
    "PositionInput": "components.position_input:PositionInput",
    "OmniTo2WD": "components.omni_to_2wd:OmniTo2WD",
    "Navigation": "components.navigation:Navigation",
    "PathFollower": "components.path_follower:PathFollower",
    "GamePad": "options.game_pad:GamePad",
    "SwitchInputRTC": "options.switch_input:SwitchInput",
    "LRFCapture_URG": "options.lrf_capture_urg:LrfCaptureUrg",
    "Urg_to_Obstacles": "options.obstacles:UrgToObstacles",
    "ObstacleMonitor": "options.obstacles:ObstacleMonitor",
    "CollisionDetection": "options.obstacles:CollisionDetection",
    "ObstaclesAvoidance": "options.obstacles:ObstaclesAvoidance",
    "Follower": "options.follower:Follower",
    "GoalInterface": "iis.interfaces:GoalInterface",
    "RunningInformation": "iis.interfaces:RunningInformation",
    "PathInterface": "iis.path_interface:PathInterface",
    "Velocity1To2": "iis.adapters:Velocity1To2",
    "Velocity2To1": "iis.adapters:Velocity2To1",
    "Velocity2To3": "iis.adapters:Velocity2To3",
    "Velocity3To2": "iis.adapters:Velocity3To2",
    "Position2To3": "iis.adapters:Position2To3",
    "Position3To2": "iis.adapters:Position3To2",
    "PositiveHeading": "iis.adapters:PositiveHeading",
    "WrappedHeading": "iis.adapters:WrappedHeading",
}
"""The motion chain of RH3, what is around it, and the interfaces of IIS, in `host.rtc.motion`."""


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
    | {name: f"tickrig.host.rtc.ucode.{module}:{name}" for module, name in _UCODE.items()}
    | {name: f"tickrig.host.rtc.motion.{place}" for name, place in _MOTION.items()},
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
