"""A motion chain that stops before obstacles, and goes on when they have gone."""

from __future__ import annotations

from typing import Final

from tickrig.host.rtc import Manager
from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.motion.components.ref_hard import Opener
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.motion.options.obstacles import (
    CollisionDetection,
    ObstacleMonitor,
    ObstaclesAvoidance,
    UrgToObstacles,
)

_LATEST: Final = {"dataport.buffer.length": "8"}


class CollisionGuard:
    """The components between a range finder and the base, in the context of a chain.

    PathFollower is joined to ObstaclesAvoidance in the place of RefHardRh3.

    Args:
        manager: who runs the chain.
        chain: of a cart.
        open_urg: opens the line to its range finder.

    Attributes:
        monitor: its `distance` is what the others act on.
    """

    def __init__(self, manager: Manager, chain: MotionChain, open_urg: Opener) -> None:
        self._manager = manager
        number = chain.ref_hard.instance_name.removeprefix("RefHardRh3")
        capture = LrfCaptureUrg(f"LRFCapture_URG{number}", open_urg)
        points = UrgToObstacles(f"Urg_to_Obstacles{number}")
        self.monitor = ObstacleMonitor(f"ObstacleMonitor{number}")
        detection = CollisionDetection(f"CollisionDetection{number}")
        avoidance = ObstaclesAvoidance(f"ObstaclesAvoidance{number}")
        self.components = (capture, points, self.monitor, detection, avoidance)
        for component in self.components:
            manager.add(component, context=chain.context)
        velocity = f"{chain.path_follower.instance_name}.velocity"
        base = chain.ref_hard.instance_name
        manager.disconnect(velocity, f"{base}.InTargetVelocity")
        for first, second in (
            (f"{capture.instance_name}.ranges", f"{points.instance_name}.ranges"),
            (f"{points.instance_name}.obstacles", f"{self.monitor.instance_name}.obstacles"),
            (f"{self.monitor.instance_name}.distance", f"{detection.instance_name}.distance"),
            (f"{self.monitor.instance_name}.distance", f"{avoidance.instance_name}.distance"),
            (velocity, f"{avoidance.instance_name}.InTargetVelocity"),
            (f"{avoidance.instance_name}.OutTargetVelocity", f"{base}.InTargetVelocity"),
        ):
            manager.connect(first, second, _LATEST)
        manager.connect(f"{detection.instance_name}.BumpRefHard", f"{base}.BumpRefHard")

    def activate(self) -> None:
        """Ask all for Active."""
        self._manager.activate(*(component.instance_name for component in self.components))
