"""Readings of a servo, with its temperatures and settings."""

from __future__ import annotations

from math import expm1, floor, inf, sqrt
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.servo.parameters import MotorParameters, PowerStage, ServoParameters
from tickrig.device.servo.plant import Plant
from tickrig.device.twin import Copyable, Part

# Whole numbers from measurements.


def nearest(value: float) -> int:
    """Return `round(value)`, in a tenth of the time where it is compiled.

    >>> [nearest(value) for value in (-2.5, -0.5, 0.5, 1.5, 2.4)]
    [-2, 0, 0, 2, 2]
    """
    low = floor(value)
    rest = value - low
    return low + 1 if rest > 0.5 or (rest == 0.5 and low & 1) else low


# The heat of a motor: winding and housing as two thermal nodes.

COPPER_PER_K: Final = 0.0039  # growth of the resistance of copper, of its value at 25 degC
HOTTEST_C: Final = 1_000.0  # no motor is left beyond this, and no model


_Temperatures = tuple[float, float]
"""Temperatures of the winding and the housing of a motor, in degC."""


class ThermalModel(Part):
    """Thermal model of a motor: winding and housing, heated by the current in the winding.

    The heat is R I^2, and R is a linear function of the temperature. For a constant mean square of
    the current, a formula gives the temperatures at any later time, without steps in between.

    The model does not include the heat from friction and from iron losses. It also does not include
    the gear, the power stage, and the effect of moving air.
    """

    __slots__ = ("_capacities", "_motor")

    def __init__(self, motor: MotorParameters) -> None:
        self._motor = motor
        self._capacities = (
            motor.winding_s / motor.winding_housing_k_w,
            motor.housing_s / motor.housing_ambient_k_w,
        )

    def resistance_ohm(self, winding_c: float) -> float:
        """Return the resistance of the winding at a temperature."""
        return self._motor.resistance_ohm * (1 + COPPER_PER_K * (winding_c - 25.0))

    def after(
        self, start: _Temperatures, seconds: float, square_a2: float, ambient_c: float
    ) -> _Temperatures:
        """Return the temperatures of winding and housing after some time.

        Args:
            start: present temperatures of winding and housing, in degC.
            seconds: time from now, 0 or more.
            square_a2: mean square of the current in this time, in A^2.
            ambient_c: temperature of the air.
        """
        # One by one: mypyc unpacks nested tuples through iterators, a third of the time here.
        motor = self._motor
        winding, housing = self._capacities
        winding_c, housing_c = start
        slope = motor.resistance_ohm * COPPER_PER_K * square_a2
        across, out = 1 / motor.winding_housing_k_w, 1 / motor.housing_ambient_k_w
        a, b = (slope - across) / winding, across / winding
        c, d = across / housing, -(across + out) / housing
        # rates of change now, then each mode of the system grows or fades by itself
        flow = across * (winding_c - housing_c)
        heat = square_a2 * self.resistance_ohm(winding_c)
        dw = (heat - flow) / winding
        dh = (flow - out * (housing_c - ambient_c)) / housing
        # The eigenvalues of the two nodes are real, because b * c > 0: heat flows both ways through
        # the same resistance. So the exponentials are real too, for any length of time.
        middle, spread = (a + d) / 2, sqrt(((a - d) / 2) ** 2 + b * c)
        slow, fast = _span(middle + spread, seconds), _span(middle - spread, seconds)
        mean, half = (slow + fast) / 2, (slow - fast) / (2 * spread)
        tilt = (a - d) / 2
        return (
            min(winding_c + mean * dw + half * (tilt * dw + b * dh), HOTTEST_C),
            min(housing_c + mean * dh + half * (c * dw - tilt * dh), HOTTEST_C),
        )


_expm1: Final = expm1  # mypyc finds it without a look-up


def _span(rate: float, seconds: float) -> float:
    """Return the integral of e^(rate t) over a time."""
    # If R rises faster with the temperature than the housing can carry the heat off, a rate is
    # positive and the temperature runs away. The limit of 50 keeps exp from overflowing;
    # `HOTTEST_C` limits the temperature long before that.
    return _expm1(min(rate * seconds, 50.0)) / rate if rate else seconds


# Temperature and overload of a servo, and the remaining current limit.


class I2t(Part):
    """I2t protection of a power stage, which limits the time of currents above the continuous one.

    The protection has a budget of (peak^2 - continuous^2) * time. A current above the continuous
    current uses up the budget, at a rate equal to the difference of the squared currents. A current
    below the continuous current restores the budget in the same way. When the budget is used up,
    only the continuous current is allowed until the whole budget is restored.

    Attributes:
        filled_a2s: used part of the budget.
        reduced: whether only the continuous current is allowed.
    """

    __slots__ = ("_budget_a2s", "_continuous_a2", "_stage", "filled_a2s", "reduced")

    def __init__(self, stage: PowerStage, before: I2t | None = None) -> None:
        self._stage = stage
        if before is None:
            self._continuous_a2 = stage.continuous_a**2
            self._budget_a2s = (stage.peak_a**2 - self._continuous_a2) * stage.peak_s
            self.filled_a2s, self.reduced = 0.0, False
        else:
            self._continuous_a2, self._budget_a2s = before._continuous_a2, before._budget_a2s
            self.filled_a2s, self.reduced = before.filled_a2s, before.reduced

    @property
    def limit_a(self) -> float:
        """Current allowed now."""
        return self._stage.continuous_a if self.reduced else self._stage.peak_a

    def pass_time(self, seconds: float, square_a2s: float) -> None:
        """Advance the time with an integral of the squared current."""
        filled = self.filled_a2s + square_a2s - self._continuous_a2 * seconds
        self.filled_a2s = min(max(filled, 0.0), self._budget_a2s)
        # Both ends are met exactly, because `min` and `max` put the value there.
        if self.filled_a2s == 0.0:
            self.reduced = False
        elif self.filled_a2s == self._budget_a2s:
            self.reduced = True

    def settled(self, current_a: float) -> bool:
        """Return whether a constant current no longer changes the state."""
        rate = current_a**2 - self._continuous_a2
        if rate < 0.0:
            return self.filled_a2s == 0.0 and not self.reduced
        # Reduced and above the continuous current: the budget stays as it is, and `bears` refuses
        # the current.
        return rate == 0.0 or self.reduced


_DERATING_K: Final = 15.0  # the limit falls to 0 over these last kelvins below the hottest


def _derated_a(limit_a: float, winding_c: float, winding_max_c: float) -> float:
    """Return the current limit reduced for a temperature of the winding.

    >>> [_derated_a(10.0, winding_c, 125.0) for winding_c in (110.0, 119.0, 125.0)]
    [10.0, 4.0, 0.0]
    """
    left = (winding_max_c - winding_c) / _DERATING_K
    return limit_a * min(max(left, 0.0), 1.0)


_AGES_S: Final = 1e9  # after this all temperatures stand still


_RESISTANCE_STEP: Final = 0.005  # how far the resistance may be off before it is followed


class Heat(Part):
    """Temperatures and I2t budget of a servo, computed from its squared current.

    Attributes:
        since_us: time of the latest computation.
        temperatures: temperatures of winding and housing at that time, in degC.
        winding_dc: temperature of the winding at that time, in 0.1 degC.
        ambient_c: temperature of the air since that time.
        i2t: overload protection of the power stage.
    """

    __slots__ = (
        *("_parameters", "_thermal", "ambient_c", "i2t", "since_us", "temperatures", "winding_dc"),
    )

    def __init__(
        self, parameters: ServoParameters, ambient_c: float, before: Heat | None = None
    ) -> None:
        self._parameters, self.ambient_c = parameters, ambient_c
        self.temperatures: _Temperatures
        if before is None:
            self._thermal, self.i2t = ThermalModel(parameters.motor), I2t(parameters.stage)
            self.temperatures, self.since_us = (ambient_c, ambient_c), 0
            self.winding_dc = round(ambient_c * 10)
        else:
            self._thermal, self.i2t = before._thermal, I2t(parameters.stage, before.i2t)
            self.temperatures, self.since_us = before.temperatures, before.since_us
            self.winding_dc = before.winding_dc

    def after(self, now_us: int, square_a2s: float) -> Heat:
        """Return a copy to which `pass_time` was applied."""
        found = Heat(self._parameters, self.ambient_c, self)
        found.pass_time(now_us, square_a2s)
        return found

    def shapes(self, resistance_ohm: float) -> bool:
        """Return whether the motor must use the present resistance instead of the given one."""
        present = self.resistance_ohm
        return abs(present - resistance_ohm) > _RESISTANCE_STEP * present

    @property
    def limit_a(self) -> float:
        """Permitted current."""
        return self._limit_at(self.temperatures[0])

    @property
    def resistance_ohm(self) -> float:
        """Resistance of the winding."""
        return self._thermal.resistance_ohm(self.temperatures[0])

    def pass_time(self, now_us: int, square_a2s: float) -> None:
        """Advance the time with an integral of the squared current, A^2 s."""
        seconds = (now_us - self.since_us) / 1_000_000
        if seconds:
            self.i2t.pass_time(seconds, square_a2s)
            self._warm(self._after(seconds, square_a2s / seconds), now_us)

    def rest(self, now_us: int, current_a: float) -> None:
        """Advance the time with a constant current; the temperatures are exactly those of `at`."""
        seconds = (now_us - self.since_us) / 1_000_000
        self.i2t.pass_time(seconds, current_a**2 * seconds)
        self._warm(self.at(now_us, current_a), now_us)

    def _warm(self, temperatures: _Temperatures, now_us: int) -> None:
        self.temperatures, self.since_us = temperatures, now_us
        self.winding_dc = nearest(temperatures[0] * 10)  # once in 20 ticks: 6 % of a drive's tick

    def at(self, now_us: int, current_a: float) -> _Temperatures:
        """Return the temperatures at an instant, if the current is constant until then."""
        return self._after((now_us - self.since_us) / 1_000_000, current_a**2)

    def bears(self, current_a: float) -> bool:
        """Return whether a current may flow permanently without changing a limit."""
        last, _ = self._after(_AGES_S, current_a**2)
        # The current limit falls with the temperature. So the highest of the temperatures now and
        # in the far future counts.
        hottest = max(last, self.temperatures[0])
        return self.i2t.settled(current_a) and abs(current_a) <= self._limit_at(hottest)

    def _after(self, seconds: float, square_a2: float) -> _Temperatures:
        return self._thermal.after(self.temperatures, seconds, square_a2, self.ambient_c)

    def _limit_at(self, winding_c: float) -> float:
        return _derated_a(self.i2t.limit_a, winding_c, self._parameters.motor.winding_max_c)


# External conditions of a servo, and the limit of its drive.


@mypyc_attr(allow_interpreted_subclasses=True)
class ServoSettings(Copyable):
    """Settings of a servo that may change while it runs, such as supply, load and faults.

    When a setting gets another value, the method `changed` is called. A subclass overrides this
    method to apply the settings.

    Attributes:
        supply_mv: supply voltage of the power stage in millivolts. It changes when `supply_v` is
            set.
    """

    __slots__ = (
        *("_ambient_c", "_blocked", "_current_limit_a", "_encoder_unplugged", "_load_kg_m2"),
        *("_load_nm", "_phase_open", "_supply_v", "supply_mv"),
    )

    def __init__(self, supply_v: float) -> None:
        self._supply_v, self._ambient_c, self._encoder_unplugged = supply_v, 25.0, False
        self.supply_mv = round(supply_v * 1_000)
        self._load_nm, self._load_kg_m2 = 0.0, 0.0
        self._blocked, self._phase_open, self._current_limit_a = False, False, inf

    def changed(self) -> None:
        """Apply the settings after a setting has changed."""

    @property
    def supply_v(self) -> float:
        """Supply of the power stage."""
        return self._supply_v

    @supply_v.setter
    def supply_v(self, value: float) -> None:
        if value != self._supply_v:
            self._supply_v, self.supply_mv = value, round(value * 1_000)
            self.changed()

    @property
    def ambient_c(self) -> float:
        """Temperature of the air."""
        return self._ambient_c

    @ambient_c.setter
    def ambient_c(self, value: float) -> None:
        if value != self._ambient_c:
            self._ambient_c = value
            self.changed()

    @property
    def encoder_unplugged(self) -> bool:
        """Whether the encoder is unplugged: the count is frozen, and motion is lost."""
        return self._encoder_unplugged

    @encoder_unplugged.setter
    def encoder_unplugged(self, value: bool) -> None:
        if value != self._encoder_unplugged:
            self._encoder_unplugged = value
            self.changed()

    @property
    def load_nm(self) -> float:
        """External torque at the output shaft; positive drives it forward."""
        return self._load_nm

    @load_nm.setter
    def load_nm(self, value: float) -> None:
        if value != self._load_nm:
            self._load_nm = value
            self.changed()

    @property
    def load_kg_m2(self) -> float:
        """Additional inertia at the output shaft."""
        return self._load_kg_m2

    @load_kg_m2.setter
    def load_kg_m2(self, value: float) -> None:
        if value != self._load_kg_m2:
            self._load_kg_m2 = value
            self.changed()

    @property
    def blocked(self) -> bool:
        """Whether the shaft is held."""
        return self._blocked

    @blocked.setter
    def blocked(self, value: bool) -> None:
        if value != self._blocked:
            self._blocked = value
            self.changed()

    @property
    def phase_open(self) -> bool:
        """Whether a phase is open, so that no current can flow."""
        return self._phase_open

    @phase_open.setter
    def phase_open(self, value: bool) -> None:
        if value != self._phase_open:
            self._phase_open = value
            self.changed()

    @property
    def current_limit_a(self) -> float:
        """Current limit of the drive; the limit of the stage may be lower."""
        return self._current_limit_a

    @current_limit_a.setter
    def current_limit_a(self, value: float) -> None:
        if value != self._current_limit_a:
            self._current_limit_a = value
            self.changed()


# Readings of a servo: for its drive through sensors, and for observers.


class Readings(ServoSettings):
    """Readings of a servo: position, speed, current and temperatures. `Servo` inherits them.

    Attributes with integers are measurements as the drive sees them. Attributes with floats are
    exact values for observers. The docstring of `Servo` describes the attributes.
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
        """Velocity of the motor in counts/s, which is 0 while the encoder is unplugged."""
        return 0 if self.encoder_unplugged else nearest(self._plant.velocity_counts_s)

    @property
    def gear_counts(self) -> int:
        """Angle of the output shaft from its absolute encoder, in counts.

        Full turns are included, so the angle is not limited to one turn. The value is 0 if the
        servo has no absolute encoder.
        """
        return floor(self.shaft_deg / 360.0 * self.parameters.encoders.gear_counts_per_turn)

    @property
    def current_ma(self) -> int:
        """Current in the winding, mA."""
        return nearest(self._plant.current_a * 1_000)

    @property
    def spare_mv(self) -> int:
        """Voltage left for driving current, in mV: largest voltage of the stage minus the back-EMF.

        The value is below 0 if an external load turns the motor faster than the supply could turn
        it.
        """
        stage, motor = self.parameters.stage, self.parameters.motor
        speed_rad_s = 0.0 if self.encoder_unplugged else abs(self._plant.speed_rad_s)
        back_emf_v = motor.torque_constant_nm_a * speed_rad_s
        return round((self.supply_v * stage.duty_max - back_emf_v) * 1_000)

    @property
    def winding_dc(self) -> int:
        """Temperature of the winding, 0.1 degC."""
        return round(self.winding_c * 10) if self.resting else self._heat.winding_dc

    @property
    def overloaded(self) -> bool:
        """Whether the I2t protection allows only the continuous current."""
        return self._heat.i2t.reduced

    @property
    def shaft_deg(self) -> float:
        """Angle of the output shaft, with all turns counted."""
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

    def _temperatures(self) -> _Temperatures:
        if self.resting:
            return self._heat.at(self.now_us, self._plant.current_a)
        return self._heat.temperatures
