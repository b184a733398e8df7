"""How a drive comes to a standstill: the option codes 605Ah to 605Eh (CiA 402-2)."""

from __future__ import annotations

from enum import IntEnum
from math import inf
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.objects import indices

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class Ramp(IntEnum):
    """How the motor is slowed down."""

    NONE = 0  # the power stage is switched off, the shaft coasts
    SLOW_DOWN = 1  # with the deceleration of the profile, 6084h
    QUICK_STOP = 2  # with the quick stop deceleration, 6085h
    CURRENT_LIMIT = 3  # as hard as the current limit lets it


STAYING: Final = 4
"""Added to a quick stop option: the drive stays in Quick stop active."""


class Stopping:
    """Slows the reference down.

    Not emulated: options 4 and 8, the voltage limit; options of a manufacturer.

    Args:
        drive: whose reference it is.
    """

    def __init__(self, drive: Ds402) -> None:
        self._drive = drive

    @property
    def stays(self) -> bool:
        """Whether a quick stop ends in Quick stop active."""
        return self._drive.parameters.number(indices.QUICK_STOP_OPTION) > STAYING

    def quick_stop(self) -> bool:
        """Make a step as 605Ah says; say whether the motor stands."""
        return self.brake(self._drive.parameters.number(indices.QUICK_STOP_OPTION) % STAYING)

    def halt(self) -> bool:
        """Make a step as 605Dh says; say whether the motor stands."""
        return self.brake(self._drive.parameters.number(indices.HALT_OPTION))

    def by(self, index: int) -> bool:
        """Make a step as another option code says; say whether the motor stands."""
        return self.brake(self._drive.parameters.number(index))

    def brake(self, ramp: int) -> bool:
        """Make a step of a ramp; say whether the motor stands, or has not to be slowed down."""
        drive, settings = self._drive, self._drive.settings
        if ramp == Ramp.NONE:
            return True
        if drive.control is Control.CURRENT:
            drive.control = Control.VELOCITY
        deceleration = {
            Ramp.SLOW_DOWN: settings.deceleration,
            Ramp.QUICK_STOP: settings.quick_stop_deceleration,
        }.get(Ramp(ramp), inf)
        return drive.reference.ramp(0.0, deceleration, deceleration) and drive.axis.stands
