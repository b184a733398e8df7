"""A range finder on a base: it goes where the base goes."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import Final

from tickrig.device.rh3.base import LOOK_US, Rh3Base
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, World
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER

USB_BAUD: Final = 12_000_000

AHEAD_M: Final = 0.2
"""From the middle of the axle to the sensor; a choice."""

OUTLINE_M: Final = 0.25
"""How wide a robot looks to others: a post around the middle of its axle; a choice."""


class MountedUrg:
    """A sensor in front of the axle, as a coupling of the rig.

    Not emulated: what it would see of its own robot, and the outline of others, which are
    round.

    Args:
        base: what carries it.
        world: what is around.
        others: bases that it sees.

    Attributes:
        urg: the sensor.
        line: its line; `b` is the host's end.
        world: it may be changed.
    """

    def __init__(self, base: Rh3Base, world: World, others: Sequence[Rh3Base] = ()) -> None:
        self._base, self._others, self.world = base, tuple(others), world
        self.urg, self.line = Urg(world=world), SerialLine(USB_BAUD)

    @property
    def tick_us(self) -> int:
        """As often as the world looks at the base."""
        return LOOK_US

    @property
    def due_us(self) -> int:
        """Never: a base that moves has work."""
        return NEVER

    def act(self, now_us: int, /) -> None:
        """Put the sensor where the base has taken it, and others where they are."""
        x_m, y_m, heading = (self._base.read(name) for name in ("x_m", "y_m", "heading_rad"))
        place = (x_m + AHEAD_M * cos(heading), y_m + AHEAD_M * sin(heading), heading)
        inputs = self.urg.inputs
        for name, value in zip(("x_m", "y_m", "heading_rad"), place, strict=True):
            if inputs[name] != value:
                inputs.set(name, value)
        places = [(base.read("x_m"), base.read("y_m")) for base in self._others]
        self.urg.world = self.world.with_posts(*(Post(x, y, OUTLINE_M) for x, y in places))
