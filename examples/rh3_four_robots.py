"""Experiment B2: four robots on one command; the hand on the pad is a program."""

from __future__ import annotations

from tickrig.emulators.rh3.convoy import Convoy  # internal
from tickrig.host.links.game_pad import StickPosition  # internal
from tickrig.host.rtc.motion.geometry import Pose  # internal
from tickrig.host.rtc.motion.options.game_pad import GamePad  # internal

SECOND_US = 1_000_000
PUSHES = (StickPosition(forward=1.0), StickPosition(turn=1.0), StickPosition())


class Program:
    """Pushes forward for 5 s, then turns to the left for 5 s."""

    def poll(self, now_us: int, /) -> StickPosition:
        """Return where it pushes."""
        return PUSHES[min(2, now_us // (5 * SECOND_US))]

    def close(self) -> None:
        """Nothing is open."""


def main() -> None:
    """Tell where all four are."""
    convoy = Convoy([Pose(0, y) for y in (0, 1, 2)], omni=[Pose(0, 3)])
    loop = convoy.loop
    loop.manager.add(GamePad("GamePad0", lambda name: Program()), rate_hz=50.0)
    convoy.command("GamePad0.velocity")
    loop.activate()
    loop.manager.activate("GamePad0")
    loop.run_to(12 * SECOND_US)
    for robot in convoy.robots:
        print("{:5.2f} {:5.2f} {:5.2f}".format(*robot.true_pose))


if __name__ == "__main__":
    main()
