"""A range finder on a base: it goes where the base goes."""

from __future__ import annotations

from math import cos, sin
from typing import Final

from tickrig.device.core import NEVER
from tickrig.device.rh3.base import LOOK_US, Rh3Base
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import World
from tickrig.emulators.serial_line import SerialLine

USB_BAUD: Final = 12_000_000

AHEAD_M: Final = 0.2
"""From the middle of the axle to the sensor; a choice."""


class MountedUrg:
    """A sensor in front of the axle, as a coupling of the rig.

    Not emulated: what it would see of its own robot, and other robots, unless they are
    posts of its world.

    Args:
        base: what carries it.
        world: what is around.

    Attributes:
        urg: the sensor.
        line: its line; `b` is the host's end.
    """

    def __init__(self, base: Rh3Base, world: World) -> None:
        self._base, self.urg = base, Urg(world=world)
        self.line = SerialLine(USB_BAUD)

    @property
    def tick_us(self) -> int:
        """As often as the world looks at the base."""
        return LOOK_US

    @property
    def due_us(self) -> int:
        """Never: a base that moves has work."""
        return NEVER

    def act(self, now_us: int, /) -> None:
        """Put the sensor where the base has taken it."""
        x_m, y_m, heading = (self._base.read(name) for name in ("x_m", "y_m", "heading_rad"))
        place = (x_m + AHEAD_M * cos(heading), y_m + AHEAD_M * sin(heading), heading)
        inputs = self.urg.inputs
        for name, value in zip(("x_m", "y_m", "heading_rad"), place, strict=True):
            if inputs[name] != value:
                inputs.set(name, value)
