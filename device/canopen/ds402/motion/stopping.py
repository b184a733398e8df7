"""How a drive comes to a standstill: the option codes 605Ah to 605Eh (CiA 402-2)."""

from __future__ import annotations

from enum import IntEnum
from math import inf
from typing import Final

from tickrig.device.canopen.ds402.motion.axis import Axis
from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.objects.parameters import Parameters
from tickrig.device.twin import Part


class Ramp(IntEnum):
    """How the motor is slowed down."""

    NONE = 0  # the power stage is switched off, the shaft coasts
    SLOW_DOWN = 1  # with the deceleration of the profile, 6084h
    QUICK_STOP = 2  # with the quick stop deceleration, 6085h
    CURRENT_LIMIT = 3  # as hard as the current limit lets it


STAYING: Final = 4
"""Added to a quick stop option: the drive stays in Quick stop active."""


class Stopping(Part):
    """Slows the reference of an axis down.

    Not emulated: options 4 and 8, the voltage limit; options of a manufacturer.

    Args:
        axis: whose reference it is.
        parameters: have the option codes.
    """

    def __init__(self, axis: Axis, parameters: Parameters) -> None:
        self._axis, self._parameters = axis, parameters

    @property
    def stays(self) -> bool:
        """Whether a quick stop ends in Quick stop active."""
        return self._parameters.number(indices.QUICK_STOP_OPTION) > STAYING

    def quick_stop(self) -> bool:
        """Make a step as 605Ah says. Returns: whether the motor stands."""
        return self.brake(self._parameters.number(indices.QUICK_STOP_OPTION) % STAYING)

    def by(self, index: int) -> bool:
        """Make a step as another option code says. Returns: whether the motor stands."""
        return self.brake(self._parameters.number(index))

    def brake(self, ramp: int) -> bool:
        """Make a step of a ramp.

        Returns:
            True if the motor stands, or has not to be slowed down.
        """
        axis, settings = self._axis, self._axis.settings
        if ramp == Ramp.NONE:
            return True
        if axis.control is Control.CURRENT:
            axis.control = Control.VELOCITY
        deceleration = {
            Ramp.SLOW_DOWN: settings.deceleration,
            Ramp.QUICK_STOP: settings.quick_stop_deceleration,
        }.get(Ramp(ramp), inf)
        return axis.reference.ramp(0.0, deceleration, deceleration) and axis.stands
