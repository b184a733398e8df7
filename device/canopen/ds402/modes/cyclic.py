"""Position modes with a latched set-point, and cyclic synchronous velocity (CiA 402-2)."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.axis import STEP_S, Control, Ramp
from tickrig.device.canopen.ds402.modes.mode import DriveView, Mode, ModeBit
from tickrig.device.servo.servo import Line

_STEP_US: Final = 1_000


class _LatchedSetPoint(Mode):
    """Follows a set-point that stays valid until another one is written.

    At the start the mode brakes, and the object of the set-point shows the reference. So nothing
    moves before the master writes a set-point.

    Attributes:
        index: index of the object of the target.
        sub: sub-index of the target.
        offset: index of the object whose value is added to the target, or 0 for none.
    """

    halts = False
    index: ClassVar[int]
    sub: ClassVar[int] = 0
    offset: ClassVar[int] = 0

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._latched: int | None = None

    def enter(self, *, enabled: bool) -> None:
        """Latch the present position."""
        self._latch()

    def run(self, now_us: int) -> bool:
        """Brake, or follow the set-point."""
        if self._latched is not None:
            if self.number(self.index, self.sub) == self._latched:
                return self._brake()
            self._latched = None
        return self.follow(now_us)

    @abstractmethod
    def follow(self, now_us: int) -> bool:
        """Make a step towards the set-point; see `Mode.step`."""

    def target(self) -> float:
        """Return the target in counts, within the software limits."""
        position = self.number(self.index, self.sub) + self._offset
        return self.take(self.drive.limits.position(self.axis.counts_near(position)))

    @property
    def _offset(self) -> int:
        return self.number(self.offset) if self.offset else 0

    def _latch(self) -> None:
        present = self.axis.position_of(self.reference.position)
        self.drive.parameters.write(self.index, present - self._offset, self.sub)
        self._latched = self.number(self.index, self.sub)

    def _brake(self) -> bool:
        deceleration = self.settings.deceleration
        stands = self.reference.ramp(0.0, deceleration, deceleration)
        self._latch()
        return stands


class CyclicPosition(_LatchedSetPoint):
    """Cyclic synchronous position mode (csp): moves to the target position on a straight line.

    The motion takes one interpolation period and then stops. Each SYNC begins a new line to the
    present target. Without SYNC, a new target begins a new line.

    The torque offset, and an extrapolation of the motion when SYNC is late, are not emulated.

    Attributes:
        rests: whether the drive needs no ticks while it stands at the target. The value is True in
            this class, and False in subclasses that have work in each tick.
    """

    shows_following_error = True
    index = indices.TARGET_POSITION
    offset = indices.POSITION_OFFSET
    rests: ClassVar[bool] = True

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self.flags, self._left = ModeBit.MODE_12, 0
        self._goal = self._ahead = 0.0

    def follow(self, now_us: int) -> bool:
        """Make a step along the line."""
        if self.drive.fresh:
            self._begin()
        if not self._left:
            self.reference.place(self.reference.position)
            return True
        self._step()
        self._left -= 1
        if not self.rests or self.limited or self._ahead or self.reference.velocity:
            return False
        self._left = 0  # it goes nowhere, and the drive may rest: 8 % of a swing
        return True

    def ahead(self) -> Line | None:
        """Return the rest of the line."""
        if self._latched is not None or self.drive.fresh:
            return None
        reference = self.reference
        line = Line((reference.position, reference.velocity), self._goal, self._left)
        line.added, line.most = self._ahead, self.settings.max_velocity
        return line

    def skip(self, steps: int) -> None:
        """Advance on the line."""
        self._left, self.limited = max(0, self._left - steps), False

    def _begin(self) -> None:
        settings = self.settings
        self._left = max(1, settings.interpolation_us // _STEP_US)
        offset = self.number(indices.VELOCITY_OFFSET)
        self._goal, self._ahead = self.target(), offset * settings.units.per_velocity

    def _step(self) -> None:
        reference = self.reference
        wanted = (self._goal - reference.position) / (self._left * STEP_S)
        velocity = self.take(self.drive.limits.velocity(wanted))
        reference.place(reference.position + velocity * STEP_S, velocity + self._ahead)


class InterpolatedPosition(CyclicPosition):
    """Interpolated position mode (ip): moves on a straight line to the set-point in 60C1h:01.

    The axis moves while bit 4 of the controlword is set, and bit 12 of the statusword is then set.
    Otherwise the axis brakes with the profile deceleration. Each motion takes one interpolation
    period, and bit 10 is set at its end. Each SYNC begins a new line. Without SYNC, a new set-point
    begins a new line.

    A buffer of set-points (60C4h) and sub-modes other than 0 (60C0h) are not emulated.
    """

    halts = True
    shows_following_error = False
    rests = False
    index = indices.INTERPOLATION_DATA
    sub = 1
    offset = 0

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._active = False

    def start(self) -> None:
        """Enable interpolation."""
        self._active = True

    def stop(self) -> None:
        """Disable interpolation."""
        self._active = False

    def run(self, now_us: int) -> bool:
        """Follow the line, or brake."""
        if not self._active:
            self._left, self.flags = 0, 0
            return self.drive.stopping.brake(Ramp.SLOW_DOWN)
        settled = super().run(now_us)
        self.flags = ModeBit.MODE_12 | (ModeBit.TARGET_REACHED if settled else 0)
        return settled

    def ahead(self) -> Line | None:
        """Return None, because the motion cannot be computed ahead.

        The statusword changes during the motion, so each step needs a call of `step`.
        """
        return None

    def halt(self, now_us: int) -> bool:
        """Brake according to 605Dh; the next record begins a line."""
        self._left, self.flags = 0, self.flags & ~ModeBit.MODE_12
        return super().halt(now_us)


class CyclicVelocity(Mode):
    """Cyclic synchronous velocity mode (csv): ramps the velocity evenly to the target velocity.

    The ramp takes one interpolation period. If the mode is chosen while the drive is enabled, the
    motion continues, because the target velocity is set to the present demanded velocity.
    """

    control: ClassVar[Control] = Control.VELOCITY
    halts = False

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._slope = 0.0

    def enter(self, *, enabled: bool) -> None:
        """Use the present velocity as target, unless the drive is just being enabled."""
        if enabled:
            self.drive.parameters.write(indices.TARGET_VELOCITY, self._present)

    @property
    def _present(self) -> int:
        velocity = round(self.reference.velocity / self.settings.units.per_velocity)
        return velocity - self.number(indices.VELOCITY_OFFSET)

    def run(self, now_us: int) -> bool:
        """Follow the ramp."""
        settings = self.settings
        wanted = self.target_velocity(self.number(indices.VELOCITY_OFFSET))
        if self.drive.fresh or not self._slope:
            away = abs(wanted - self.reference.velocity)
            self._slope = away * 1_000_000 / settings.interpolation_us or 1.0
        reached = self.reference.ramp(
            wanted,
            min(self._slope, settings.max_acceleration),
            min(self._slope, settings.max_deceleration),
        )
        self.flags = ModeBit.MODE_12
        return reached


# Maxon's own modes: a setting value is the reference at once (EPOS Firmware Specification).

_CURRENT_SETTING: Final = 0x2030
_POSITION_SETTING: Final = 0x2062
_VELOCITY_SETTING: Final = 0x206B

SETTINGS: Final = (_CURRENT_SETTING, _POSITION_SETTING, _VELOCITY_SETTING)


class _PositionSetting(_LatchedSetPoint):
    """Position mode, -1: moves to 2062h, in position units.

    Bit 8 of the controlword has no effect in these modes (DECISION K21).
    """

    index = _POSITION_SETTING

    def follow(self, now_us: int) -> bool:
        """Set the reference to the setting value."""
        self.reference.place(self.target())
        return True


class _VelocitySetting(Mode):
    """Velocity mode, -2, which turns at 206Bh, in velocity units.

    When the mode is chosen while the drive is enabled, 206Bh is set to the present velocity
    (DECISION K21).
    """

    control = Control.VELOCITY
    halts = False

    def enter(self, *, enabled: bool) -> None:
        """Use the present velocity, unless the drive is just being enabled."""
        if enabled:
            present = round(self.reference.velocity / self.settings.units.per_velocity)
            self.drive.parameters.write(_VELOCITY_SETTING, present)

    def run(self, now_us: int) -> bool:
        """Turn at the velocity of the setting value."""
        wanted = self.number(_VELOCITY_SETTING) * self.settings.units.per_velocity
        velocity = self.take(self.drive.limits.velocity(wanted))
        self.reference.place(self.reference.position, velocity)
        return True


class _CurrentSetting(Mode):
    """Current mode, -3, which applies 2030h, in milliamperes.

    When the mode is chosen while the drive is enabled, 2030h is set to the present current
    (DECISION K21).
    """

    control = Control.CURRENT
    halts = False

    def enter(self, *, enabled: bool) -> None:
        """Use the present current, unless the drive is just being enabled."""
        if enabled:
            present = round(1_000 * self.reference.current_a) * self.axis.forward
            self.drive.parameters.write(_CURRENT_SETTING, present)

    def run(self, now_us: int) -> bool:
        """Drive the current of the setting value."""
        wanted_a = self.number(_CURRENT_SETTING) / 1_000 * self.axis.forward
        self.reference.current_a = self.take(self.drive.limits.current(wanted_a))
        return True


MODES: Final[dict[int, type[Mode]]] = {
    -1: _PositionSetting,
    -2: _VelocitySetting,
    -3: _CurrentSetting,
}
"""Modes by their number in 6060h."""
