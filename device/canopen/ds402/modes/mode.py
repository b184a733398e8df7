"""What a drive does in Operation enabled: the base of all modes of operation (CiA 402-2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.state.state import Controlword, Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class Mode:
    """No mode: the motor comes to a standstill and is held there.

    A mode moves `drive.reference`, which is that of the mode before when it begins,
    and says in `flags` what it has to tell. The drive then commands the motor.

    Attributes:
        control: the loop that the motor works with.
        halts: bit 8 of the controlword stops it.
        minds_limits: limit switches and software limits stop it; homing looks itself.
        tells_following_error: bit 13 says that the motor does not follow.
        drive: where settings, targets and the motor are.
        flags: its bits in the statusword: 10, 12, 13 and what else it owns.
    """

    control: ClassVar[Control] = Control.POSITION
    halts: ClassVar[bool] = True
    minds_limits: ClassVar[bool] = True
    tells_following_error: ClassVar[bool] = False

    def __init__(self, drive: Ds402) -> None:
        self.drive, self.reference = drive, drive.reference
        self.flags = Statusword(0)

    def enter(self) -> None:
        """Begin: the drive is enabled, or the mode is chosen while it is."""

    def start(self) -> None:
        """Act on the rising edge of bit 4 of the controlword, in Operation enabled."""

    def stop(self) -> None:
        """Act on its falling edge."""

    def run(self, now_us: int) -> bool:
        """Make a step of a millisecond; say whether nothing is left to do."""
        return self.halt(now_us)

    def halt(self, now_us: int) -> bool:
        """Make a step to a standstill, as 605Dh says; say whether it stands."""
        stands = self.drive.stopping.halt()
        self.flags = self.flags | Statusword.TARGET_REACHED if stands else self._moving
        return stands

    @property
    def halted(self) -> bool:
        """Whether bit 8 of the controlword is set."""
        return bool(self.drive.controlword & Controlword.HALT)

    @property
    def _moving(self) -> Statusword:
        return self.flags & ~Statusword.TARGET_REACHED
