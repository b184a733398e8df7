"""How far the devices of a rig may work ahead of their ticks."""

from __future__ import annotations

from tickrig.device.twin import Part


class Horizon(Part):
    """What a rig knows of time, told to those devices on it that have an attribute `horizon`.

    Attributes:
        passed_us: all ticks up to this time are done.
        until_us: up to this time nobody looks at a device between its ticks, except in an
            action of the event queue, and what it sends and hears is all that is seen of it.
    """

    __slots__ = ("passed_us", "until_us")

    def __init__(self) -> None:
        self.passed_us = self.until_us = 0
