"""The limit up to which devices of a rig may compute ahead of their ticks."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.twin import Part


@dataclass
class Horizon(Part):
    """Limit up to which the devices of a rig may compute their ticks ahead.

    A rig shares the object with its devices that have an attribute `horizon`.

    Attributes:
        passed_us: time up to which all ticks are done.
        until_us: time up to which only the traffic of a device is observed, so that its ticks can
            be computed ahead. Until then nothing reads the device between its ticks, except an
            action of the event queue.
    """

    passed_us: int = 0
    until_us: int = 0
