"""What a drive needs of its motor, and a motor without physics."""

from __future__ import annotations

from typing import Final, Protocol

from tickrig.device.twin import Part


class Motor(Protocol):
    """A motor with power stage, encoder and control loops; see `device.servo.servo.Servo`.

    Attributes:
        current_limit_a: the current that the drive allows.
    """

    current_limit_a: float

    @property
    def counts_per_turn(self) -> int:
        """Counts of the encoder in a turn of the motor."""

    @property
    def counts(self) -> int:
        """What the encoder says."""

    @property
    def velocity_counts_s(self) -> int:
        """Its rate, in counts per second."""

    @property
    def current_ma(self) -> int:
        """Current of the motor, in milliamperes, with the sign of its torque."""

    @property
    def supply_mv(self) -> int:
        """Supply of the power stage, in millivolts."""

    @property
    def winding_dc(self) -> int:
        """Temperature of the winding, in tenths of a degree Celsius."""

    @property
    def current_limited(self) -> bool:
        """Whether a limit cut the demand in the last step."""

    @property
    def shaft_deg(self) -> float:
        """Angle of the output shaft."""

    @property
    def shaft_deg_s(self) -> float:
        """Its speed."""

    @property
    def resting(self) -> bool:
        """Whether nothing would change without a new command or input."""

    def release(self) -> None:
        """Switch the power stage off."""

    def drive_current(self, current_a: float) -> None:
        """Have this current."""

    def drive_velocity(self, velocity: float, acceleration: float = 0.0) -> None:
        """Have this velocity, in counts per second."""

    def drive_position(
        self, position: float, velocity: float = 0.0, acceleration: float = 0.0
    ) -> None:
        """Be at this position, in counts."""

    def step_to(self, now_us: int) -> None:
        """Let time pass."""


COUNTS_S2_PER_A: Final = 1_000.0


class IdealMotor(Part):
    """A motor that is at once where it shall be, and as fast as it shall be.

    It stands still at once when it is released. A current turns it as a mass without
    friction: 1 A gives 1000 counts per second per second.

    Not emulated: load, temperature, limits of current and voltage.
    """

    counts_per_turn: Final = 2_000
    supply_mv: Final = 24_000
    winding_dc: Final = 250
    current_limited: Final = False

    def __init__(self) -> None:
        self.current_limit_a = 0.0
        self._position = self._velocity = self._current_a = 0.0
        self._moves_by_itself = False
        self._now_us = 0

    @property
    def counts(self) -> int:
        """The position, rounded."""
        return round(self._position)

    @property
    def velocity_counts_s(self) -> int:
        """The velocity, rounded."""
        return round(self._velocity)

    @property
    def shaft_deg(self) -> float:
        """The same in degrees."""
        return self._position / self.counts_per_turn * 360

    @property
    def shaft_deg_s(self) -> float:
        """The velocity in degrees per second."""
        return self._velocity / self.counts_per_turn * 360

    @property
    def current_ma(self) -> int:
        """The current that it was given."""
        return round(self._current_a * 1_000)

    @property
    def resting(self) -> bool:
        """Whether it stands, and no current turns it."""
        return self._velocity == 0 and self._current_a == 0

    def release(self) -> None:
        """Stand still."""
        self._velocity = self._current_a = 0.0

    def drive_current(self, current_a: float) -> None:
        """Turn faster and faster."""
        self._current_a, self._moves_by_itself = current_a, True

    def drive_velocity(self, velocity: float, acceleration: float = 0.0) -> None:
        """Turn."""
        self._velocity, self._current_a, self._moves_by_itself = velocity, 0.0, True

    def drive_position(
        self, position: float, velocity: float = 0.0, acceleration: float = 0.0
    ) -> None:
        """Be there."""
        self._position, self._velocity, self._current_a = position, velocity, 0.0
        self._moves_by_itself = False

    def step_to(self, now_us: int) -> None:
        """Turn on, unless its position is given."""
        passed_s, self._now_us = (now_us - self._now_us) / 1_000_000, now_us
        if self._moves_by_itself:
            before = self._velocity
            self._velocity += self._current_a * COUNTS_S2_PER_A * passed_s
            self._position += (before + self._velocity) / 2 * passed_s
