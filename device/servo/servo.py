"""A motor with its power stage, gear, load, encoders and control loops."""

from __future__ import annotations

from enum import Enum
from math import copysign, floor, inf, pi
from typing import Final

from tickrig.device.servo.parameters import ServoParameters
from tickrig.device.servo.plant import BREAKAWAY, STEP_S, Plant
from tickrig.device.servo.readings import Heat, Readings
from tickrig.device.twin import Part

# Theory of operation
# ===================
#
# A servo has four parts in three files:
#
# - `_Loops` computes which current is wanted.
# - `Plant` in plant.py computes how winding, shaft and friction react to this current.
# - `Heat` in readings.py computes temperatures and I2t from the squared current.
# - `Servo` calls the other three.
#
# One control step is 1 ms, whatever the tick of the drive. `step_to(now_us)` makes the steps for
# the time that has passed. In each step:
#
# 1. The loops turn position and velocity demand into a current (`_push`).
# 2. If limit and voltage allow, the plant leads the current to this demand; then it moves
#    (`Plant.drive`).
# 3. The encoder counts whole counts, unless it is unplugged.
# 4. Every 20 ms, heat and I2t are computed from the current since the previous time
#    (`_update_limit`).
# 5. If the step has changed nothing, the servo begins to rest (`_rest`).
#
# Rules that hold this together:
#
# - Set after stepping. External conditions and demands apply from the instant up to which `step_to`
#   has run. A setter that is called before `step_to` changes the past.
# - Derived numbers have one writer. `changed` computes plant load, friction bounds, inertia and
#   limits from the settings. Heat changes the resistance and `_limit_a` in `_update_limit`. A new
#   setting needs its property in `ServoSettings` and its line in `changed`.
# - Resting is exact. A servo rests only when a step leaves position, current, integral and cut
#   unchanged to the bit. Floating point makes that possible because dry friction stops the shaft at
#   exactly 0.0 (plant.py) and a demand within one count counts as reached (`_Loops`). While the
#   servo rests, no steps are made, and `Heat.at` alone computes the temperatures in closed form.
#   `_wake` accounts for the time of rest before anything else changes.
# - Several steps in one call are the same steps. `run_ahead` repeats `Loops.follow` and `turn`,
#   `Plant.drive`, `_rub`, `_lead`, `_mean` and `_turn`, the counting of `_step` and the check of
#   `_update_limit`, on local variables and in the same order of operations.
#   `tests/device/servo/test_run_ahead.py` compares them to the bit: if you change one formula, or
#   the order of two additions, change it in both. Where anything special begins (friction holds,
#   the demand is cut, the resistance is followed, a bound is left), the run ends before that step,
#   and single steps follow. `device/canopen/ds402/stretch.py` uses `run_ahead`.
# - No step depends on an earlier trial. `run_ahead` changes nothing; `follow` applies its result.
#
# Numbers: motors, stages and gears are in parameters.py with their sources. Gains are natural
# frequencies, so they keep their meaning with another motor. 1 ms is the tick of the drives on CAN.
# 20 ms between two computations of heat is short compared to the second for which a stage carries
# its peak current, and to the 16 s of a winding.

# The velocity and position loops of a drive.


class _Loops(Part):
    """A position loop around a velocity loop, in control steps of 1 ms.

    The position loop is proportional, in whole counts. It ignores an error below one count while
    the demand is constant. The velocity loop is proportional and integral. Acceleration, viscous
    and dry friction are fed forward. While the current demand is cut, the integral does not grow
    further in the direction of the cut.

    Attributes:
        integral_a: share of the integral in the current.
        cut: direction in which the latest demand was cut: -1 or 1, or 0 if it was not cut.
    """

    __slots__ = (
        "_accelerate",
        "_dry",
        "_integral",
        "_position",
        "_proportional",
        "_rad",
        "_viscous",
        "cut",
        "integral_a",
    )

    def __init__(self, parameters: ServoParameters) -> None:
        gains, motor = parameters.gains, parameters.motor
        k, natural = motor.torque_constant_nm_a, gains.velocity_rad_s
        self._rad = 2 * pi / parameters.encoders.counts_per_turn
        self._accelerate = parameters.inertia_kg_m2 / k
        self._dry, self._viscous = parameters.coulomb_nm / k, motor.viscous_nm_s / k
        self._proportional = 2 * gains.damping * natural * self._accelerate
        self._integral = natural**2 * self._accelerate * STEP_S
        self._position = gains.position_rad_s
        self.integral_a, self.cut = 0.0, 0

    @property
    def gains(self) -> tuple[float, float, float, float, float, float]:
        """Rad per count, and gains of position, integral, error, speed and friction."""
        proportional, viscous, dry = self._proportional, self._viscous, self._dry
        return self._rad, self._position, self._integral, proportional, viscous, dry

    def follow(
        self, position: float, counts: int, velocity: float, acceleration: float, speed: float
    ) -> float:
        """Return the current for a demanded position, in A."""
        # The encoder cannot resolve an error below one count. Without this case the integral would
        # push against friction permanently, and the servo would never rest.
        error = position - counts
        if velocity == 0.0 and -1.0 < error < 1.0:
            error = 0.0
        return self.turn(velocity + self._position * error, acceleration, speed)

    def turn(self, velocity: float, acceleration: float, speed: float) -> float:
        """Run the velocity loop for one step, and return the current that it demands, in A.

        Args:
            velocity: demanded velocity, in counts/s.
            acceleration: demanded acceleration, in counts/s^2.
            speed: measured speed of the motor, in rad/s.
        """
        wanted = velocity * self._rad
        error = wanted - speed
        # Anti-windup: while the demand is cut, the integral may only change back, away from the
        # cut.
        if error * self.cut <= 0.0:
            self.integral_a += self._integral * error
        current = self.integral_a + self._proportional * error + self._viscous * wanted
        if wanted != 0.0:
            current += copysign(self._dry, wanted)
        return current + self._accelerate * self._rad * acceleration


# Several control steps of a servo in one go, without events.


class Line(Part):
    """Demanded positions on a straight line to a goal, for the next steps of `Servo.run_ahead`.

    After the goal the demanded position stays at the goal.

    Attributes:
        position: present demanded position, in counts.
        velocity: present demanded velocity, in counts/s.
        goal: position at the end of the line, in counts.
        left: number of steps up to the goal.
        added: velocity offset that the master of the drive has set, in counts/s. It is added to the
            velocity of the line.
        most: largest velocity of the line, in counts/s. `run_ahead` ends before a step that needs
            more.
    """

    __slots__ = ("added", "goal", "left", "most", "position", "velocity")

    def __init__(self, start: tuple[float, float], goal: float, left: int) -> None:
        self.position, self.velocity = start
        self.goal, self.left = goal, left
        self.added, self.most = 0.0, inf

    def go_on(self, steps: int, demand: tuple[float, float]) -> None:
        """Pass over steps, up to a demand."""
        self.position, self.velocity = demand
        self.left = max(0, self.left - steps)


Bounds = tuple[float, float, float, float, int]
"""Bounds of a run; the run ends before a step that would leave them.

In this order:

- lowest position, counts;
- highest position, counts;
- largest distance from the demanded position, counts;
- velocity up to which the motor counts as standing, counts/s: the motor may not stand while a
  higher velocity is demanded;
- highest temperature of the winding, 0.1 degC.

"""

Four = tuple[float, float, float, float]


class RunAhead(Part):
    """Result of `Servo.run_ahead`: the state of a servo after some steps, to be applied later.

    Attributes:
        steps: number of steps.
        counts: position that the encoder shows, in counts.
        demand: demanded position (counts) and demanded velocity (counts/s) after these steps.
        motion: position of the motor (counts), speed of the motor (rad/s), current in the winding
            (A), and integral of the velocity loop (A).
        losses: energy from the power stage since the start (J), heat of the winding (J), heat of
            friction (J), and integral of the squared current (A^2 s).
        heat: temperatures and I2t budget of the servo.
    """

    __slots__ = ("counts", "demand", "heat", "losses", "motion", "steps")

    def __init__(
        self, state: tuple[int, int], demand: tuple[float, float], motion: Four, losses: Four,
        heat: Heat,
    ) -> None:  # fmt: skip
        self.steps, self.counts = state
        self.demand, self.motion, self.losses, self.heat = demand, motion, losses, heat


STEP_US: Final = 1_000
_SLOW_US: Final = 20_000  # between two looks at heat and overload


class _Demand(Enum):
    """Kinds of demand on the motor."""

    NOTHING = "nothing"
    CURRENT = "current"
    VELOCITY = "velocity"
    POSITION = "position"


class Servo(Readings):
    """A motor with power stage, gear, load, encoders and loops, in steps of 1 ms.

    Call `step_to(now_us)` first, then set external conditions and demands: they apply from that
    instant. Setting the same value again has no effect, so a drive may set it in each tick. While
    the servo is `resting`, nothing moves and no steps are computed; the temperatures follow in
    closed form.

    Not emulated: see `Plant`, `ThermalModel` and `_Loops`. The velocity is measured without noise;
    the supply gives and takes any current.

    Attributes:
        supply_v: supply voltage of the power stage.
        load_nm: external torque at the output shaft. A positive torque drives the shaft forward.
        load_kg_m2: additional inertia at the output shaft.
        blocked: whether the shaft is held.
        encoder_unplugged: whether the encoder is unplugged: the count is frozen, and motion is
            lost.
        phase_open: whether a phase is open, so that no current can flow.
        ambient_c: temperature of the air.
        current_limit_a: current limit of the drive. The limit of the stage may be lower.
        counts: position of the motor, in counts.
        current_limited: whether the limit or the voltage cut the demand in the latest step.
        resting: whether nothing changes without a new demand or input.
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
        self._loops, self._lost_counts = _Loops(parameters), 0.0
        self._demand, self._values = _Demand.NOTHING, (0.0, 0.0, 0.0)
        self.changed()

    # what the drive wants

    def release(self) -> None:
        """Switch the power stage off; the shaft coasts."""
        self._want(_Demand.NOTHING, (0.0, 0.0, 0.0))

    def drive_current(self, current_a: float) -> None:
        """Drive a current."""
        self._want(_Demand.CURRENT, (current_a, 0.0, 0.0))

    def drive_velocity(self, velocity: float, acceleration: float = 0.0) -> None:
        """Drive at a velocity in counts/s; the acceleration in counts/s^2 is fed forward."""
        self._want(_Demand.VELOCITY, (0.0, velocity, acceleration))

    def drive_position(
        self, position: float, velocity: float = 0.0, acceleration: float = 0.0
    ) -> None:
        """Demand a position, which the position controller of the servo follows.

        The velocity loop also gets the demanded velocity and acceleration (feed-forward).

        Args:
            position: demanded position now, in counts. Fractions are accepted.
            velocity: demanded velocity now, in counts/s.
            acceleration: demanded acceleration in the next millisecond, in counts/s^2.
        """
        self._want(_Demand.POSITION, (position, velocity, acceleration))

    def _want(self, demand: _Demand, values: tuple[float, float, float]) -> None:
        """Set a demand if it differs."""
        if demand is not self._demand or values != self._values:
            if self.resting:
                self._wake()
            self._demand, self._values = demand, values

    # several control steps in one go

    @property
    def is_plain(self) -> bool:
        """Whether the next control steps may be plain ones, which `run_ahead` can compute."""
        special = self.resting or self._off or self.encoder_unplugged or self._loops.cut
        return not special and self._values[2] == 0.0 and self._demand is _Demand.POSITION

    def run_ahead(  # noqa: PLR0912, PLR0915 - one loop over locals
        self, line: Line, most_steps: int, bounds: Bounds
    ) -> RunAhead:
        """Compute the next control steps ahead, without applying them.

        The results are exactly the same as if each step were computed separately. Some steps need
        separate treatment, and the computation ends before the first of them. These are steps in
        which friction stops or holds the shaft, in which the demand is limited, in which the
        resistance of the motor is computed again, or after which the servo would be outside
        `bounds`. The servo can continue with single steps.

        Args:
            line: demanded positions without acceleration, beginning with the present demand.
            most_steps: largest number of steps.
            bounds: bounds of the position, the following error, the velocity and the temperature,
                as described at `Bounds`.
        """
        # one loop over locals takes half the time of calls
        plant, loops, heat = self._plant, self._loops, self._heat
        (s0, s1, s2, s3), (a0, a1, a2, a3) = plant.rows
        k, el, b, per_rad = plant.constants
        rad, stiffness, integral_gain, proportional, viscous, dry = loops.gains
        r, load, blocked = plant.resistance_ohm, plant.load_nm, plant.blocked
        low, high = plant.friction_nm
        low_breakaway, high_breakaway = low * BREAKAWAY, high * BREAKAWAY
        first, last, window, slow, hottest_dc = bounds
        losses, counts, lost_counts = plant.losses, self.counts, self._lost_counts
        electrical, copper = losses.electrical_j, losses.copper_j
        rubbed, squares = losses.friction_j, losses.square_a2s
        angle, w, i, integral = plant.position, plant.speed_rad_s, plant.current_a, loops.integral_a
        fast, steps = slow + 1.0, 0
        position, velocity, left = line.position, line.velocity, line.left
        goal, added, most = line.goal, line.added, line.most
        most_a, most_v = self._limit_a, self._limit_v
        look = (
            _SLOW_US - STEP_US - self.now_us + heat.since_us
        ) // STEP_US  # the step that ends with it
        while steps < most_steps:
            ahead_velocity = 0.0
            if left:
                ahead_velocity = (goal - position) / (left * STEP_S)
                if not -most <= ahead_velocity <= most:
                    break
            error = position - counts
            if velocity == 0.0 and -1.0 < error < 1.0:
                error = 0.0
            wanted = (velocity + stiffness * error) * rad
            error = wanted - w
            led = integral + integral_gain * error
            current = led + proportional * error + viscous * wanted
            if wanted != 0.0:
                current += dry if wanted > 0.0 else -dry  # `copysign` is a call of Python
            current += 0.0  # no acceleration is fed forward
            if w == 0.0 or blocked or not -most_a <= current <= most_a:
                break
            free = s0 * i + s1 * w + s2 * current + s3 * load
            friction = -free / s3
            if low_breakaway <= friction <= high_breakaway:
                break
            friction = low if friction < low else high
            speed = free + s3 * friction
            slope_v = el * (current - i) / STEP_S
            if (
                not -most_v <= r * i + k * w + slope_v <= most_v
                or not -most_v <= r * current + k * speed + slope_v <= most_v
            ):
                break
            way = a0 * i + a1 * w + a2 * current + a3 * (load + friction)
            ahead = angle + way * per_rad
            seen = floor(ahead - lost_counts + 0.5)
            rate = speed * per_rad
            rolls = not -fast <= rate <= fast or abs(round(rate)) > slow  # `round` is one, too
            turns = rolls or -slow <= velocity <= slow
            follows = turns and -window <= position - seen <= window
            if not (follows and first <= seen <= last and speed):
                break
            square = (i * i + i * current + current * current) / 3 * STEP_S
            squared = squares + square
            if steps == look:  # looks belong to a run: three wake-ups fewer in 40 ms
                warmer = heat.after(self.now_us + (steps + 1) * STEP_US, squared)
                if warmer.shapes(r) or warmer.winding_dc > hottest_dc:
                    break
                heat, most_a, squared = warmer, self._allowed_a(warmer), 0.0
                look += _SLOW_US // STEP_US
            squares = squared
            middle = (6 * way / STEP_S - w - speed) / 4
            mean = (i * w + 2 * (i + current) * middle + current * speed) * STEP_S / 6
            electrical += r * square + el * (current * current - i * i) / 2 + k * mean
            copper += r * square
            rubbed += b * (w * w + w * speed + speed * speed) / 3 * STEP_S - friction * way
            angle, w, i, integral, counts = ahead, speed, current, led, seen
            if left:
                position += ahead_velocity * STEP_S
                velocity, left = ahead_velocity + added, left - 1
            else:
                velocity = 0.0
            steps += 1
        return RunAhead(
            (steps, counts), (position, velocity), (angle, w, i, integral),
            (electrical, copper, rubbed, squares), heat,
        )  # fmt: skip

    def follow(self, run: RunAhead) -> None:
        """Apply the steps of a run, then set its demand as `drive_position` does."""
        plant, losses = self._plant, self._plant.losses
        plant.position, plant.speed_rad_s, plant.current_a, self._loops.integral_a = run.motion
        losses.electrical_j, losses.copper_j, losses.friction_j, losses.square_a2s = run.losses
        self.counts, self.current_limited = run.counts, False
        self.now_us += run.steps * STEP_US
        if run.heat is not self._heat:
            self._heat = run.heat
            self._limit_a = self._allowed_a(run.heat)
        position, velocity = run.demand
        self._values = position, velocity, 0.0

    # time

    def changed(self) -> None:
        """Apply external conditions and the limit of the drive."""
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
        self._limit_a = self._allowed_a(self._heat)

    def step_to(self, now_us: int) -> None:
        """Advance in control steps to `now_us`."""
        while not self.resting and now_us - self.now_us >= STEP_US:
            self._step()
        self.now_us += (now_us - self.now_us) // STEP_US * STEP_US

    def _step(self) -> None:
        """Run one control step."""
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
        # After `now_us` has moved on: the look belongs to the end of this step.
        if self.now_us - self._heat.since_us >= _SLOW_US:
            self._update_limit()
        if (
            plant.speed_rad_s == 0.0
            and plant.position == position
            and plant.current_a == current
            and loops.integral_a == integral
            and loops.cut == cut
        ):
            self._rest()

    def _push(self, plant: Plant, loops: _Loops) -> int:
        """Apply the demand; return the direction in which it was cut."""
        demand = self._demand
        value, velocity, acceleration = self._values  # not both at once: mypyc would iterate
        if demand is _Demand.NOTHING or self._off:
            loops.integral_a = 0.0
            plant.open()
            return 0
        speed = 0.0 if self.encoder_unplugged else plant.speed_rad_s
        if demand is _Demand.POSITION:
            current = loops.follow(value, self.counts, velocity, acceleration, speed)
        elif demand is _Demand.VELOCITY:
            current = loops.turn(velocity, acceleration, speed)
        else:
            current, loops.integral_a = value, 0.0
        limit = self._limit_a
        if current > limit:
            # A demand that the current limit cuts counts as cut in this direction. If the voltage
            # cut it too, the direction of that cut counts.
            return plant.drive(limit, self._limit_v) or 1
        if current < -limit:
            return plant.drive(-limit, self._limit_v) or -1
        return plant.drive(current, self._limit_v)

    def _update_limit(self) -> None:
        """Update heat and overload with the latest steps."""
        plant, heat = self._plant, self._heat
        heat.pass_time(self.now_us, plant.losses.square_a2s)
        plant.losses.square_a2s = 0.0
        if heat.shapes(plant.resistance_ohm):
            plant.shape(plant.inertia_kg_m2, heat.resistance_ohm)
        self._limit_a = self._allowed_a(heat)

    def _allowed_a(self, heat: Heat) -> float:
        return max(min(self.current_limit_a, heat.limit_a), 0.0)

    def _rest(self) -> None:
        """Enter rest, unless the current will change."""
        self._update_limit()
        current, limit = self._plant.current_a, self._limit_a
        # A current that the voltage limits is U/R, and R follows the temperature. So the current
        # will change.
        by_voltage = self.current_limited and abs(current) != limit  # follows the resistance
        self.resting = not by_voltage and self._heat.bears(current)

    def _wake(self) -> None:
        """Account for the time of rest."""
        # Computed with the current, air temperature and limits of the time of rest, so before the
        # caller changes them.
        self._heat.rest(self.now_us, self._plant.current_a)
        self.resting = False
        self._update_limit()
