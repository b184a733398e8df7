"""Profile position mode (CiA 402-2): set-points, in sequence or at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from tickrig.device.canopen.ds402 import indices, trapezoid
from tickrig.device.canopen.ds402.modes.mode import DriveView, Mode, ModeBit, Window
from tickrig.device.canopen.ds402.settings import Settings
from tickrig.device.twin import Immutable
from tickrig.wire.canopen.drive import Controlword

SLOWEST: Final = 1.0
"""Lowest velocity in counts per second, so that each profile ends."""

STEEPEST: Final = 1e12
"""Acceleration for ramps without a limit, in counts per second per second."""


@dataclass(frozen=True, slots=True)
class _SetPoint(Immutable):
    """A target and its limits, as they were when the set-point was given.

    Attributes:
        target: target in counts.
        limits: limits of the path.
        end_velocity: speed at the target, in counts per second.
        cut: whether a software limit has moved the target.
    """

    target: float
    limits: trapezoid.PathLimits
    end_velocity: float
    cut: bool


class ProfilePosition(Mode):
    """Moves to set-points. While the axis moves to a set-point, one more set-point may wait.

    The target, velocities and ramps of a set-point are latched when bit 4 rises; later changes
    apply to the next set-point. Bit 12 falls when bit 4 has fallen and no set-point waits. While
    a set-point waits, only a set-point with immediate change is accepted. A relative target is
    added to the previous target. If bit 9 is set, the motor passes the present set-point at its
    profile velocity, unless the direction reverses at that set-point.

    Bit 10 is set when no set-point waits, the profile has ended, and the motor has been within
    6067h of the target for the time 6068h. After a set-point with an end velocity the motor
    continues at that velocity.

    Not emulated: 60F2h positioning option code; more than one waiting set-point.
    """

    shows_following_error = True

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._path, self._near = trapezoid.PathFollower(self.reference), Window()
        self._present: _SetPoint | None = None
        self._waiting: _SetPoint | None = None
        self._last = self.reference.position
        self._acknowledges = self._arrived = False

    def start(self) -> None:
        """Accept a new set-point and acknowledge it."""
        self._acknowledges = True
        controlword, present = self.drive.controlword, self._present
        if present is None or self._arrived or controlword & Controlword.CHANGE_AT_ONCE:
            self._go(self._set_point())
        elif self._waiting is None:
            self._waiting = self._set_point()
            if controlword & Controlword.CHANGE_ON_SET_POINT:
                self._pass_by(present, self._waiting)

    def stop(self) -> None:
        """Clear the acknowledge bit."""
        self._acknowledges = False

    def run(self, now_us: int) -> bool:
        """Follow the path; at its end start the next set-point."""
        if not self._path.kept:
            self._path.begin(self._plan(trapezoid.began_us(now_us)))
        if self._path.follow(now_us):
            if self._waiting is None:
                self._arrived = True
            else:
                self._go(self._waiting)
        self._show(now_us)
        return self._arrived and self.reference.velocity == 0 and not self._near.waiting

    def halt(self, now_us: int) -> bool:
        """Brake according to 605Dh; the motion continues afterwards."""
        stands = super().halt(now_us)
        self._acknowledge()
        return stands

    def _go(self, point: _SetPoint) -> None:
        """Plan the path to a set-point from the present motion."""
        self._present, self._waiting, self._arrived = point, None, False
        self._path.leave()

    def _pass_by(self, present: _SetPoint, following: _SetPoint) -> None:
        """Pass the present set-point without a stop if the next one lies in the same direction."""
        onward = (following.target - present.target) * (present.target - self.reference.position)
        if onward > 0:
            self._present = replace(present, end_velocity=present.limits.velocity)
            self._path.leave()

    def _set_point(self) -> _SetPoint:
        settings, position = self.settings, self.number(indices.TARGET_POSITION)
        if self.drive.controlword & Controlword.RELATIVE:
            target = self._last + position * settings.units.per_position
        else:
            target = self.axis.counts_of(position)
        self._last, cut = self.drive.limits.position(target)
        number = self.number(indices.MOTION_PROFILE)
        shape = (
            trapezoid.RampShape.SIN2
            if number == trapezoid.RampShape.SIN2
            else trapezoid.RampShape.LINEAR
        )
        limits = _profile_limits(settings, shape)
        return _SetPoint(self._last, limits, settings.end_velocity, cut)

    def _plan(self, now_us: int) -> trapezoid.Path:
        start, point = self._path.motion, self._present
        if point is None:
            return trapezoid.to_velocity(now_us, start, 0.0, _profile_limits(self.settings))
        return trapezoid.to_position(now_us, start, point.target, point.limits, point.end_velocity)

    def _show(self, now_us: int) -> None:
        settings, point = self.settings, self._present
        goal = self.reference.position if point is None else point.target
        away = abs(self.axis.motor.counts - round(goal))
        passed = point is not None and point.end_velocity > 0
        near = self._arrived and (passed or away <= settings.position_window)
        reached = self._near.holds(now_us, near, settings.position_window_us)
        self.flags = ModeBit.TARGET_REACHED if reached else 0
        self.limited |= point is not None and point.cut
        self._acknowledge()

    def _acknowledge(self) -> None:
        """Set or clear bit 12."""
        self.flags &= ~ModeBit.MODE_12
        if self._acknowledges or self._waiting:
            self.flags |= ModeBit.MODE_12


def _profile_limits(
    settings: Settings, shape: trapezoid.RampShape = trapezoid.RampShape.LINEAR
) -> trapezoid.PathLimits:
    """Return the limits of 6081h, 6083h and 6084h; a profile velocity of 0 means the slowest."""
    return trapezoid.PathLimits(
        max(SLOWEST, settings.profile_velocity),
        min(STEEPEST, settings.acceleration),
        min(STEEPEST, settings.deceleration),
        shape,
    )
