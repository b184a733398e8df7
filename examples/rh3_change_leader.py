"""Experiment B1: the leader is changed while all run, by re-connecting components.

A cart follows another that stands on its left. Then its Follower is joined to the pose of
the robot on omni wheels, to the right, and to nothing else.
"""

from __future__ import annotations

from tickrig.emulators.rh3.convoy import Convoy  # internal
from tickrig.host.rtc.motion.geometry import Pose  # internal

SECOND_US = 1_000_000


def main() -> None:
    """Follow the one, then the other."""
    convoy = Convoy([Pose(4.0, 2.0), Pose()], omni=[Pose(4.0, -2.0)])
    loop, cart = convoy.loop, convoy.robots[1]
    loop.activate()
    convoy.follow(1, leader=0)
    loop.run_to(6 * SECOND_US)
    print("towards the cart:  {:.1f} {:.1f}".format(*cart.true_pose))
    convoy.follow(1, leader=2)
    loop.run_to(30 * SECOND_US)
    print("behind the other:  {:.1f} {:.1f}".format(*cart.true_pose))


if __name__ == "__main__":
    main()
