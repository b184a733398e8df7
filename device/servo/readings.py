"""What a servo shows: to its drive through sensors, and to whoever looks at it."""

from __future__ import annotations

from math import floor

from tickrig.device.servo.heat import Heat
from tickrig.device.servo.parameters import ServoParameters
from tickrig.device.servo.plant import Plant
from tickrig.device.servo.settings import ServoSettings
from tickrig.device.servo.thermal import Temperatures


class Readings(ServoSettings):
    """The servo as seen; `Servo` says what its attributes are.

    Whole numbers are what the drive measures, fractions what an observer sees.
    """

    __slots__ = (
        "_degrees_per_count",
        "_heat",
        "_plant",
        "counts",
        "counts_per_turn",
        "current_limited",
        "gear_ratio",
        "now_us",
        "parameters",
        "resting",
    )

    def __init__(self, parameters: ServoParameters) -> None:
        super().__init__(parameters.stage.supply_v)
        self.parameters, self._plant = parameters, Plant(parameters)
        self._heat = Heat(parameters, self.ambient_c)
        self.counts_per_turn = parameters.encoders.counts_per_turn
        self.gear_ratio = parameters.gear.ratio
        self._degrees_per_count = 360.0 / self.counts_per_turn / self.gear_ratio
        self.now_us = self.counts = 0
        self.current_limited = self.resting = False

    @property
    def velocity_counts_s(self) -> int:
        """Velocity of the motor, counts/s; 0 while the encoder is unplugged."""
        return 0 if self.encoder_unplugged else round(self._plant.velocity_counts_s)

    @property
    def gear_counts(self) -> int:
        """Angle by the absolute encoder of the output shaft, all turns counted; 0 without one."""
        return floor(self.shaft_deg / 360.0 * self.parameters.encoders.gear_counts_per_turn)

    @property
    def current_ma(self) -> int:
        """Current in the winding, mA."""
        return round(self._plant.current_a * 1_000)

    @property
    def supply_mv(self) -> int:
        """Supply of the power stage, mV."""
        return round(self.supply_v * 1_000)

    @property
    def spare_mv(self) -> int:
        """Voltage that the stage has left above the back-EMF; below 0 a load drives the motor."""
        stage, motor = self.parameters.stage, self.parameters.motor
        speed_rad_s = 0.0 if self.encoder_unplugged else abs(self._plant.speed_rad_s)
        back_emf_v = motor.torque_constant_nm_a * speed_rad_s
        return round((self.supply_v * stage.duty_max - back_emf_v) * 1_000)

    @property
    def winding_dc(self) -> int:
        """Temperature of the winding, 0.1 degC."""
        return round(self.winding_c * 10)

    @property
    def overloaded(self) -> bool:
        """Whether the I2t protection allows only the continuous current."""
        return self._heat.i2t.reduced

    @property
    def shaft_deg(self) -> float:
        """Angle of the output shaft, all turns counted."""
        return self._plant.position * self._degrees_per_count

    @property
    def shaft_deg_s(self) -> float:
        """Velocity of the output shaft."""
        return self._plant.velocity_counts_s * self._degrees_per_count

    @property
    def motor_rad_s(self) -> float:
        """Speed of the motor."""
        return self._plant.speed_rad_s

    @property
    def current_a(self) -> float:
        """Current in the winding."""
        return self._plant.current_a

    @property
    def winding_c(self) -> float:
        """Temperature of the winding."""
        return self._temperatures()[0]

    @property
    def housing_c(self) -> float:
        """Temperature of the housing."""
        return self._temperatures()[1]

    def _temperatures(self) -> Temperatures:
        if self.resting:
            return self._heat.at(self.now_us, self._plant.current_a)
        return self._heat.temperatures
