"""The moved axis: its motor, where its zero is, and where it may go."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.ds402.motion.motor import Motor
from tickrig.device.canopen.ds402.motion.reference import Control, Reference
from tickrig.device.canopen.ds402.objects.settings import Settings
from tickrig.device.twin import Part

STANDSTILL_TURNS_S: Final = 0.5
"""A motor that turns more slowly stands: its encoder resolves no better within a tick."""


class Axis(Part):
    """Positions of the user are INTEGER32 and wrap at the ends of 607Bh.

    Attributes:
        motor: what moves.
        reference: what the motor is demanded to do, in counts.
        control: the loop that the motor works with in this tick.
        settings: the present configuration.
        zero: counts of the encoder at position 0 of the user.
        homed: whether a homing has set it.
    """

    def __init__(self, motor: Motor, settings: Settings) -> None:
        self.motor: Motor = motor
        self.settings = settings
        self.reference, self.control = Reference(), Control.POSITION
        self.zero, self.homed = 0.0, False

    @property
    def position(self) -> int:
        """Position actual value, in units of the user."""
        return self.position_of(self.motor.counts)

    @property
    def stands(self) -> bool:
        """Whether the motor stands, as far as its encoder shows."""
        return not self.is_fast(self.motor.velocity_counts_s)

    @property
    def forward(self) -> int:
        """Sign of the counts in the positive direction of the user."""
        return 1 if self.settings.units.per_position > 0 else -1

    @property
    def ends(self) -> tuple[float, float]:
        """Software limits in counts, the lower one first; infinite if there are none."""
        low, high = self.settings.software_limits
        return low + self.zero, high + self.zero

    @property
    def following_error(self) -> float:
        """Counts from the motor to the reference."""
        return self.reference.position - self.motor.counts

    @property
    def unwrapped(self) -> tuple[float, float]:
        """Lowest and highest counts, within a unit, at which `wrap` does nothing."""
        low, high = self.settings.position_range
        unit = self.settings.units.per_position
        first, last = sorted((self.zero + (low + 1) * unit, self.zero + (high - 1) * unit))
        return first, last

    @property
    def standstill(self) -> float:
        """Velocity up to which the motor stands, in counts per second."""
        return STANDSTILL_TURNS_S * self.motor.counts_per_turn

    def is_fast(self, velocity: float) -> bool:
        """Return whether a velocity in counts per second is more than standstill."""
        return abs(velocity) > self.standstill

    def position_of(self, counts: float) -> int:
        """Return the position of the user at these counts."""
        low, high = self.settings.position_range
        position = round((counts - self.zero) / self.settings.units.per_position)
        return (position - low) % (high - low + 1) + low

    def counts_of(self, position: int) -> float:
        """Return the counts at a position of the user."""
        return self.zero + position * self.settings.units.per_position

    def counts_near(self, position: int) -> float:
        """Return the counts at a position, on the shorter way from the reference."""
        low, high = self.settings.position_range
        span = high - low + 1
        unit = self.settings.units.per_position
        away = position - (self.reference.position - self.zero) / unit
        return self.reference.position + ((away + span / 2) % span - span / 2) * unit

    def per_mille_of(self, current_a: float) -> int:
        """Return a current in thousandths of the rated one; the user's sign."""
        return round(1_000 * current_a / self.settings.rated_current_a) * self.forward

    def wrap(self) -> None:
        """Move the zero by a whole range when the motor has left the range."""
        low, high = self.settings.position_range
        unit = self.settings.units.per_position
        turns = (round((self.motor.counts - self.zero) / unit) - low) // (high - low + 1)
        self.zero += turns * (high - low + 1) * unit

    def place_home(self, position: int, counts: int) -> None:
        """Take a place for a position of the user: homing is attained."""
        self.zero = counts - position * self.settings.units.per_position
        self.homed = True

    def command(self) -> None:
        """Have the motor do what the reference says; what is not controlled follows it."""
        motor, reference, control = self.motor, self.reference, self.control
        if control is not Control.CURRENT:
            reference.current_a = motor.current_ma / 1_000
        if control is Control.POSITION:
            motor.drive_position(reference.position, reference.velocity, reference.acceleration)
        elif control is Control.VELOCITY:
            motor.drive_velocity(reference.velocity, reference.acceleration)
            reference.position = float(motor.counts)
        else:
            motor.drive_current(reference.current_a)
            reference.place(motor.counts, motor.velocity_counts_s)

    def release(self) -> None:
        """Switch the power stage off."""
        self.motor.release()
        self.reference.place(self.motor.counts, self.motor.velocity_counts_s)
        self.reference.current_a = 0.0

    def configure(self, settings: Settings) -> None:
        """Follow another configuration."""
        self.settings = settings
        self.motor.current_limit_a = min(settings.max_current_a, *settings.limits_a)
