"""Base of all modes of operation: the work of a drive in Operation enabled (CiA 402-2)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, ClassVar

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.axis import Axis, Clamped, Control, Limits, Stopping, Switches
from tickrig.device.canopen.ds402.settings import Parameters, Settings
from tickrig.device.twin import Part
from tickrig.wire.canopen.drive import Controlword, Statusword

if TYPE_CHECKING:
    from tickrig.device.servo.servo import Line


class ModeBit(IntEnum):
    """Bits of the statusword whose meaning depends on the mode of operation."""

    # Plain numbers, which are faster than the members of a flag.
    TARGET_REACHED = Statusword.TARGET_REACHED
    MODE_12 = Statusword.MODE_12
    MODE_13 = Statusword.MODE_13


@dataclass(slots=True, kw_only=True)
class DriveView:
    """The parts of a drive that its modes of operation use.

    Attributes:
        parameters: objects of the drive, with defaults for missing objects.
        axis: axis with its motor, its reference and its settings.
        switches: limit switches and home switch.
        limits: limits of the axis.
        stopping: object that brakes according to the option codes.
        controlword: the latest controlword.
        fresh: whether a SYNC has arrived or a target has changed since the last step.
    """

    parameters: Parameters
    axis: Axis
    switches: Switches
    limits: Limits
    stopping: Stopping
    controlword: int = 0
    fresh: bool = False


class Mode(Part):
    """No mode: the motor comes to a standstill and is held there.

    A mode moves the reference of the axis. It starts from the reference at the end of the
    previous mode. The drive then commands the motor.

    Args:
        drive: parts of the drive that the mode uses.

    Attributes:
        control: control loop of the motor.
        halts: whether bit 8 of the controlword stops the mode.
        minds_limits: whether limit switches and software limits stop the mode. Homing checks them
            itself.
        shows_following_error: whether bit 13 shows a following error.
        flags: bits of the mode in the statusword: 10, 12, 13 and additional bits.
        limited: whether a limit cut a demand in the last step (bit 11 of the statusword).
    """

    control: ClassVar[Control] = Control.POSITION
    halts: ClassVar[bool] = True
    minds_limits: ClassVar[bool] = True
    shows_following_error: ClassVar[bool] = False

    def __init__(self, drive: DriveView) -> None:
        self.drive, self.axis, self.reference = drive, drive.axis, drive.axis.reference
        self._parameters = drive.parameters
        self.flags, self.limited = 0, False

    @property
    def settings(self) -> Settings:
        """The present configuration."""
        return self.axis.settings

    def number(self, index: int, sub: int = 0) -> int:
        """Return the value of an object; see `Parameters.number`."""
        return self._parameters.number(index, sub)

    def enter(self, *, enabled: bool) -> None:
        """Start this mode of operation, either when it is chosen or when the drive is enabled.

        Args:
            enabled: whether the drive was already in Operation enabled when the mode was chosen.
                False means that the drive is just being enabled.
        """

    def start(self) -> None:
        """Act on the rising edge of bit 4 of the controlword, in Operation enabled."""

    def stop(self) -> None:
        """Act on the falling edge of bit 4 of the controlword."""

    def step(self, now_us: int) -> bool:
        """Run one control period of the mode, or brake if the controlword demands a halt.

        Returns:
            True if the mode is idle until its inputs change.
        """
        self.limited = False
        halted = self.halts and self.drive.controlword & Controlword.HALT
        return self.halt(now_us) if halted else self.run(now_us)

    def run(self, now_us: int) -> bool:
        """Run one control period; see `step`."""
        return self.halt(now_us)

    def ahead(self) -> Line | None:
        """Return the demanded motion of the next steps, if it is known in advance.

        A drive calls this method to compute several ticks at once. The result is valid as long as
        no input changes.

        Returns:
            The motion as a `Line`, which has a constant velocity up to a goal. The result is None
            if the drive must call `step` for each step.
        """
        return None

    def skip(self, steps: int) -> None:
        """Advance the mode by a number of steps; the caller sets the reference."""

    def halt(self, now_us: int) -> bool:
        """Brake according to 605Dh; see `step`."""
        stands = self.drive.stopping.by(indices.HALT_OPTION)
        self.flags &= ~ModeBit.TARGET_REACHED
        if stands:
            self.flags |= ModeBit.TARGET_REACHED
        return stands

    def take(self, demand: Clamped) -> float:
        """Return the limited demand; the statusword shows whether a limit cut it."""
        value, clamped = demand
        self.limited |= clamped
        return value

    def target_velocity(self, offset: int = 0) -> float:
        """Return 60FFh and an offset in counts per second, within the limits."""
        wanted = self.number(indices.TARGET_VELOCITY) + offset
        return self.take(self.drive.limits.velocity(wanted * self.settings.units.per_velocity))

    def target_current(self, offset: int = 0) -> float:
        """Return 6071h and an offset in amperes, within the limits."""
        per_mille = (self.number(indices.TARGET_TORQUE) + offset) * self.axis.forward
        wanted_a = per_mille * self.settings.rated_current_a / 1_000
        return self.take(self.drive.limits.current(wanted_a))


class Window(Part):
    """Detects that a condition has been true for a given time, as for "target reached".

    Attributes:
        waiting: whether the condition is true, but not yet for long enough.
    """

    __slots__ = ("_since_us", "waiting")

    def __init__(self) -> None:
        self.waiting = False
        self._since_us: int | None = None

    def holds(self, now_us: int, inside: bool, for_us: int) -> bool:
        """Update the condition; return whether it has been true for `for_us`."""
        if not inside:
            self._since_us, self.waiting = None, False
            return False
        if self._since_us is None:
            self._since_us = now_us
        self.waiting = now_us - self._since_us < for_us
        return not self.waiting
