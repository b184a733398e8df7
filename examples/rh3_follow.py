"""Experiment A: robots follow a preceding one by its position.

The first cart goes to a goal. A second cart follows it, a third follows the second, and a
robot on omni wheels follows the first. Everything runs in virtual time.
"""

from __future__ import annotations

from tickrig.emulators.rh3.convoy import Convoy  # internal
from tickrig.host.rtc.motion.geometry import Pose  # internal

SECOND_US = 1_000_000


def main() -> None:
    """Go 3 m, and tell where all are."""
    carts = [Pose(), Pose(-1.0, 0.2), Pose(-2.0, -0.2)]
    convoy = Convoy(carts, omni=[Pose(-1.0, -1.0)])
    for robot, leader in ((1, 0), (2, 1), (3, 0)):
        convoy.follow(robot, leader)
    loop = convoy.loop
    loop.activate()
    loop.run_to(SECOND_US)
    loop.chain.position_input.goal(Pose(3.0, 1.0, 0.0))
    for t_us in range(6 * SECOND_US, 30 * SECOND_US, 6 * SECOND_US):
        loop.run_to(t_us)
        places = ("{:5.2f} {:5.2f}".format(*robot.true_pose) for robot in convoy.robots)
        print(f"{t_us / 1e6:2.0f} s:", " | ".join(places))


if __name__ == "__main__":
    main()
