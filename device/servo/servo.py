"""A motor with its power stage, gear, load, encoders and control loops."""

from __future__ import annotations

from enum import Enum
from math import floor
from typing import Final

from tickrig.device.servo.loops import Loops
from tickrig.device.servo.parameters import ServoParameters
from tickrig.device.servo.plant import Plant
from tickrig.device.servo.readings import Readings
from tickrig.device.servo.run_ahead import Demands, RunAhead, work_out

STEP_US: Final = 1_000
SLOW_US: Final = 20_000  # between two looks at heat and overload
RESISTANCE_STEP: Final = 0.005  # how far the resistance may be off before it is followed


class Demand(Enum):
    """What the drive wants of the motor."""

    NOTHING = "nothing"
    CURRENT = "current"
    VELOCITY = "velocity"
    POSITION = "position"


class Servo(Readings):
    """A motor with power stage, gear, load, encoders and loops, in steps of 1 ms.

    Call `step_to(now_us)` first, then set what the world does and what the
    drive wants: it holds from that instant. A value that was set already
    changes nothing, so a drive may repeat itself in each tick. While
    `resting`, nothing moves and time passes at no cost; the temperatures
    follow in closed form.

    Not emulated: see `Plant`, `ThermalModel` and `Loops`; the velocity is
    measured without noise, the supply gives and takes any current.

    Attributes:
        supply_v: supply of the power stage.
        load_nm: external torque at the output shaft; positive drives it forward.
        load_kg_m2: inertia at the output shaft beside what is always there.
        blocked: the shaft is held.
        encoder_unplugged: the counts stand still, and are lost.
        phase_open: no current can flow.
        ambient_c: temperature of the air.
        current_limit_a: what the drive allows; the stage may allow less.
        counts: position of the motor.
        current_limited: limit or voltage cut the demand in the latest step.
        resting: without a new demand or input nothing would change.
        now_us: time of the latest control step.
    """

    __slots__ = (
        "_demand",
        "_limit_a",
        "_limit_v",
        "_loops",
        "_lost_counts",
        "_off",
        "_values",
    )

    def __init__(self, parameters: ServoParameters) -> None:
        super().__init__(parameters)
        self._loops, self._lost_counts = Loops(parameters), 0.0
        self._demand, self._values = Demand.NOTHING, (0.0, 0.0, 0.0)
        self.changed()

    # what the drive wants

    def release(self) -> None:
        """Switch the power stage off; the shaft coasts."""
        self._want(Demand.NOTHING, (0.0, 0.0, 0.0))

    def drive_current(self, current_a: float) -> None:
        """Impose a current."""
        self._want(Demand.CURRENT, (current_a, 0.0, 0.0))

    def drive_velocity(self, velocity: float, acceleration: float = 0.0) -> None:
        """Keep a velocity, counts/s; the acceleration, counts/s^2, is fed forward."""
        self._want(Demand.VELOCITY, (0.0, velocity, acceleration))

    def drive_position(
        self, position: float, velocity: float = 0.0, acceleration: float = 0.0
    ) -> None:
        """Keep a position; velocity and acceleration are fed forward.

        Args:
            position: where the shaft shall be now, counts; fractions are taken.
            velocity: the velocity that it shall have now, counts/s.
            acceleration: its acceleration in the next millisecond, counts/s^2.
        """
        self._want(Demand.POSITION, (position, velocity, acceleration))

    def _want(self, demand: Demand, values: tuple[float, float, float]) -> None:
        """Take a demand, if it is another one."""
        if demand is not self._demand or values != self._values:
            if self.resting:
                self._wake()
            self._demand, self._values = demand, values

    # several control steps in one go

    @property
    def plain_steps(self) -> int:
        """How many control steps at most may be plain, so that `run_ahead` can work them out."""
        feed = self._values[2]
        special = self.resting or self._off or self.encoder_unplugged or self._loops.cut
        if special or feed != 0.0 or self._demand is not Demand.POSITION:
            return 0
        return (SLOW_US - STEP_US - self.now_us + self._heat.since_us) // STEP_US

    def run_ahead(
        self, demands: Demands, counts: tuple[float, float], error: float, standstill: float
    ) -> RunAhead:
        """Work out up to `plain_steps` control steps; they are not made.

        Args:
            demands: position and velocity for each of them, the first as it is demanded now.
            counts: as in `Bounds`, where the run ends.
            error: the same.
            standstill: the same.
        """
        first, last = counts
        bounds = (self._limit_a, self._limit_v, first, last, error, standstill)
        encoder = self.counts, self._lost_counts
        return work_out(self._plant, self._loops, encoder, demands, bounds)

    def follow(self, run: RunAhead, position: float, velocity: float) -> None:
        """Make the steps of a run, then have a position as `drive_position` does."""
        plant, losses = self._plant, self._plant.losses
        plant.position, plant.speed_rad_s, plant.current_a, self._loops.integral_a = run.motion
        losses.electrical_j, losses.copper_j, losses.friction_j, losses.square_a2s = run.losses
        self.counts, self.current_limited = run.counts, False
        self.now_us += run.steps * STEP_US
        self._values = (position, velocity, 0.0)

    # time

    def changed(self) -> None:
        """Take over what the world does and what the drive allows."""
        if self.resting:
            self._wake()
        plant, parameters = self._plant, self.parameters
        ratio = parameters.gear.ratio
        plant.bear(self.load_nm / ratio, parameters.gear.efficiency)
        inertia = parameters.inertia_kg_m2 + self.load_kg_m2 / ratio**2
        if inertia != plant.inertia_kg_m2:
            plant.shape(inertia, plant.resistance_ohm)
        if self.blocked != plant.blocked:
            plant.hold(self.blocked)
        self._heat.ambient_c = self.ambient_c
        self._off = self.phase_open or self.supply_v < parameters.stage.supply_min_v
        self._limit_v = self.supply_v * parameters.stage.duty_max
        self._limit_a = max(min(self.current_limit_a, self._heat.limit_a), 0.0)

    def step_to(self, now_us: int) -> None:
        """Let time pass in control steps until `now_us`."""
        while not self.resting and now_us - self.now_us >= STEP_US:
            self._step()
        self.now_us += (now_us - self.now_us) // STEP_US * STEP_US

    def _step(self) -> None:
        """Let one control step pass."""
        plant, loops = self._plant, self._loops
        position, current = plant.position, plant.current_a
        integral, cut = loops.integral_a, loops.cut
        loops.cut = self._push(plant, loops)
        self.current_limited = loops.cut != 0
        if self.encoder_unplugged:
            self._lost_counts = plant.position - self.counts
        else:
            self.counts = floor(plant.position - self._lost_counts + 0.5)
        self.now_us += STEP_US
        if self.now_us - self._heat.since_us >= SLOW_US:
            self._update_limit()
        if (
            plant.speed_rad_s == 0.0
            and plant.position == position
            and plant.current_a == current
            and loops.integral_a == integral
            and loops.cut == cut
        ):
            self._rest()

    def _push(self, plant: Plant, loops: Loops) -> int:
        """Act on the demand; return the direction in which it was cut."""
        demand, (value, velocity, acceleration) = self._demand, self._values
        if demand is Demand.NOTHING or self._off:
            loops.integral_a = 0.0
            plant.open()
            return 0
        speed = 0.0 if self.encoder_unplugged else plant.speed_rad_s
        if demand is Demand.POSITION:
            current = loops.follow(value, self.counts, velocity, acceleration, speed)
        elif demand is Demand.VELOCITY:
            current = loops.turn(velocity, acceleration, speed)
        else:
            current, loops.integral_a = value, 0.0
        limit = self._limit_a
        if current > limit:
            return plant.drive(limit, self._limit_v) or 1
        if current < -limit:
            return plant.drive(-limit, self._limit_v) or -1
        return plant.drive(current, self._limit_v)

    def _update_limit(self) -> None:
        """Take heat and overload of the latest steps into account."""
        plant, heat = self._plant, self._heat
        heat.pass_time(self.now_us, plant.losses.square_a2s)
        plant.losses.square_a2s = 0.0
        resistance = heat.resistance_ohm
        if abs(resistance - plant.resistance_ohm) > RESISTANCE_STEP * resistance:
            plant.shape(plant.inertia_kg_m2, resistance)
        self._limit_a = max(min(self.current_limit_a, heat.limit_a), 0.0)

    def _rest(self) -> None:
        """Rest, unless the current will not stay as it is."""
        self._update_limit()
        current, limit = self._plant.current_a, self._limit_a
        by_voltage = self.current_limited and abs(current) != limit  # follows the resistance
        self.resting = not by_voltage and self._heat.bears(current)

    def _wake(self) -> None:
        """Take the time of rest into account."""
        self._heat.rest(self.now_us, self._plant.current_a)
        self.resting = False
        self._update_limit()
