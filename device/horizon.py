"""The limit up to which devices of a rig may compute ahead of their ticks."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.twin import Part


@dataclass
class Horizon(Part):
    """Time up to which the devices of a rig may compute their ticks ahead.

    A rig shares the object with its devices that have an attribute `horizon`.

    Attributes:
        passed_us: time up to which all ticks are done.
        until_us: time up to which a device may compute its ticks ahead. Before this time, the rig
            exchanges frames with the device, but does not read its state. There is one exception: a
            scheduled action of the rig (an action of the event queue) may read the state between
            two ticks.
    """

    passed_us: int = 0
    until_us: int = 0
