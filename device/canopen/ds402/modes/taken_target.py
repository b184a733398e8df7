"""Position modes that follow a target at once, and take the present one when they begin."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from tickrig.device.canopen.ds402.modes.mode import Mode

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class TakenTarget(Mode):
    """Brakes when it begins, and follows its target as soon as somebody writes another one.

    Meanwhile the object of the target shows the reference: nothing moves before
    the master says so.

    Attributes:
        index: object of the target.
        sub: its sub-index.
        offset: object that is added to it, 0 for none.
    """

    halts = False
    index: ClassVar[int]
    sub: ClassVar[int] = 0
    offset: ClassVar[int] = 0

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self._own: int | None = None

    def enter(self) -> None:
        """Take the present position for the target."""
        self._take()

    def run(self, now_us: int) -> bool:
        """Brake, or follow."""
        if self._own is not None:
            if self.drive.parameters.number(self.index, self.sub) == self._own:
                return self._brake()
            self._own = None
        return self.follow(now_us)

    @abstractmethod
    def follow(self, now_us: int) -> bool:
        """Make a step towards the target; say whether nothing is left to do."""

    def target(self) -> float:
        """Return the target in counts, within the software limits."""
        number = self.drive.parameters.number
        position = number(self.index, self.sub) + (number(self.offset) if self.offset else 0)
        return self.drive.within(self.drive.axis.counts_near(position))

    def _take(self) -> None:
        parameters = self.drive.parameters
        present = self.drive.axis.position_of(self.reference.position)
        parameters.write(
            self.index, present - (parameters.number(self.offset) if self.offset else 0), self.sub
        )
        self._own = parameters.number(self.index, self.sub)

    def _brake(self) -> bool:
        deceleration = self.drive.settings.deceleration
        stands = self.reference.ramp(0.0, deceleration, deceleration)
        self._take()
        return stands
