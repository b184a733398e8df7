"""The shaft of the motor core unit, in degrees: motor, gear and both encoders."""

from __future__ import annotations

from math import remainder

from tickrig.device.servo.servo import Servo
from tickrig.device.twin import Part


class Shaft(Part):
    """Counts of the motor encoder as an angle of the shaft; the gear encoder says where 0 is.

    Args:
        servo: motor, gear and loops.
    """

    def __init__(self, servo: Servo) -> None:
        self.servo = servo
        self._counts_per_deg = servo.counts_per_turn * servo.gear_ratio / 360
        self._gear_deg = 360 / servo.parameters.encoders.gear_counts_per_turn
        self._zero_counts = 0.0

    @property
    def angle_ndeg(self) -> int:
        """Angle by the motor encoder."""
        return round((self.servo.counts - self._zero_counts) / self._counts_per_deg * 1e9)

    @property
    def velocity_udeg_s(self) -> int:
        """Velocity by the motor encoder."""
        return round(self.servo.velocity_counts_s / self._counts_per_deg * 1e6)

    @property
    def current_ma(self) -> int:
        """Current in the motor."""
        return self.servo.current_ma

    @property
    def slip_deg(self) -> float:
        """By how much the encoders disagree."""
        return abs(remainder(self.angle_ndeg / 1e9 - self._gear_angle_deg, 360))

    @property
    def _gear_angle_deg(self) -> float:
        """Angle by the gear encoder, -180..180."""
        return remainder(self.servo.gear_counts * self._gear_deg, 360)

    def find_zero(self) -> None:
        """Take the angle from the gear encoder; it knows no turns."""
        self._zero_counts = self.servo.counts - self._gear_angle_deg * self._counts_per_deg

    def release(self) -> None:
        """Take the power off."""
        self.servo.release()

    def push(self, current_a: float) -> None:
        """Let a current flow."""
        self.servo.drive_current(current_a)

    def turn(self, velocity_deg_s: float, acceleration_deg_s2: float) -> None:
        """Turn with a velocity."""
        scale = self._counts_per_deg
        self.servo.drive_velocity(velocity_deg_s * scale, acceleration_deg_s2 * scale)

    def point(self, position_deg: float, velocity_deg_s: float, acceleration_deg_s2: float) -> None:
        """Be at a position."""
        scale = self._counts_per_deg
        self.servo.drive_position(
            position_deg * scale + self._zero_counts,
            velocity_deg_s * scale,
            acceleration_deg_s2 * scale,
        )
