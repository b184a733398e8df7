"""A cart of Reference Hardware 3 goes to a goal in virtual time, on rough ground.

    python examples/rh3_goto.py

Six components run in closed loop over an emulated base; `SerialBaseConnection` in place of
`ClosedLoop` drives a real one.
"""

from __future__ import annotations

from tickrig.device.rh3.parameters import BaseParameters  # internal
from tickrig.emulators.rh3.closed_loop import ClosedLoop  # internal
from tickrig.host.rtc.motion.drive import drive, start  # internal
from tickrig.host.rtc.motion.geometry import Pose  # internal

GOAL = Pose(1.0, 0.5, 1.57)


def main() -> None:
    """Drive with both configuration sets."""
    for set_id in ("default", "tuned"):
        loop = ClosedLoop(BaseParameters(noise=0.05, seed=7))
        start(loop, set_id)
        run = drive(loop, [GOAL])
        thought = loop.chain.odometry.pose
        print(f"{set_id}: {run.reached_s:.2f} s, {run.error_m * 1e3:.1f} mm off the goal;")
        print(f"  odometry thinks {thought.distance(GOAL) * 1e3:.1f} mm")


if __name__ == "__main__":
    main()
