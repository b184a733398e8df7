"""The limit up to which devices of a rig may compute ahead of their ticks."""

from __future__ import annotations

from tickrig.device.twin import Part


class Horizon(Part):
    """Time limits of a rig, shared with its devices that have an attribute `horizon`.

    Attributes:
        passed_us: all ticks up to this time are done.
        until_us: up to this time nothing reads a device between its ticks, except an action of the
            event queue; only its traffic is observed.
    """

    __slots__ = ("passed_us", "until_us")

    def __init__(self) -> None:
        self.passed_us = self.until_us = 0
