"""A cart with a range finder waits before a post, and goes on when somebody has taken it away."""

from __future__ import annotations

from tickrig import SimLink
from tickrig.device.urg.world import Post, World  # internal
from tickrig.emulators.rh3.closed_loop import ClosedLoop  # internal
from tickrig.host.rtc.motion.geometry import Pose  # internal
from tickrig.host.rtc.motion.options.obstacles import CollisionGuard  # internal

SECOND_US = 1_000_000


def main() -> None:
    """Drive 3 m with a post on the way."""
    loop = ClosedLoop(world=World(posts=(Post(2.0, 0.1, 0.2),)))
    (eye,) = loop.range_finders
    guard = CollisionGuard(loop.manager, loop.chain, lambda name: SimLink(loop.rig, eye.line.b))
    loop.activate("tuned")
    guard.activate()
    loop.run_to(SECOND_US)
    loop.chain.position_input.goal(Pose(3.0))
    for seconds in range(5, 25, 5):
        if seconds == 15:
            eye.world = World()
        loop.run_to(seconds * SECOND_US)
        print(f"{seconds:2} s: {loop.pose.x:.2f} m")


if __name__ == "__main__":
    main()
