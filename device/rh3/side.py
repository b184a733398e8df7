"""A wheel with its control loops, counter and faults in the driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import copysign, floor, sqrt
from typing import Final

from tickrig.device.modbus import Registers
from tickrig.device.physical import QuantityBank
from tickrig.device.rh3.parameters import PER_MILLE, BaseParameters
from tickrig.device.twin import Part
from tickrig.wire.modbus import Fault

# A wheel with its motor, gear and encoder.

_SLOW: Final = 0.5
"""Speed in counts/ms below which friction can hold a wheel."""

_BRAKE: Final = 500.0
"""Braking torque of the shorted motor in per mille, which is our choice."""


class _Wheel(Part):
    """A wheel turned by torque against friction and load, in steps of a millisecond.

    Not emulated: inductance and back-EMF of the motor, play and stiffness of the gear,
    heat.

    Args:
        parameters: parameters of the base.

    Attributes:
        travel: number of counts since the start of the rig, with fractions.
        speed: speed in counts/ms.
        load: torque against forward motion, in per mille.
        jammed: whether something holds the wheel.
        friction: torque that is needed to turn the wheel, in per mille.
        agility: speed in counts/ms that a per mille of torque adds in a millisecond.
    """

    def __init__(self, parameters: BaseParameters) -> None:
        self.agility = parameters.agility
        self.friction = parameters.per_mille(parameters.friction_nm)
        self.travel = self.speed = self.load = 0.0
        self.jammed = False

    @property
    def counts(self) -> int:
        """Count of the encoder."""
        return floor(self.travel)

    def held(self, torque: float) -> bool:
        """Return whether the wheel stands still and a torque would not move it."""
        return not self.speed and (self.jammed or abs(torque - self.load) <= self.friction)

    def step(self, torque: float) -> None:
        """Run a millisecond with a torque in per mille."""
        speed, friction, net = self.speed, self.friction, torque - self.load
        if self.jammed or (-_SLOW < speed < _SLOW and -friction <= net <= friction):
            self.speed = 0.0
            return
        against = friction if (speed or net) > 0 else -friction
        self.speed = speed = speed + (net - against) * self.agility
        self.travel += speed

    def brake(self) -> None:
        """Run a millisecond with the motor shorted."""
        # Never more torque than stops the wheel in this millisecond: a brake does not drive the
        # wheel backward.
        most = min(_BRAKE, abs(self.speed) / self.agility)
        self.step(-copysign(most, self.speed) if self.speed else 0.0)


# The servo of a wheel: ramp and PID loop of its speed, and motion to a position.

_DEADBAND: Final = 1
"""Distance in counts that counts as reached."""


class _PositionLoop(Part):
    """A PID loop from counts to counts/ms, with gains P in 1/s, I in 1/s2, and D without unit.

    Args:
        registers: registers that hold the gains and limits.
    """

    def __init__(self, registers: Registers) -> None:
        self._registers = registers
        self.begin()

    def begin(self) -> None:
        """Restart the loop."""
        self._sum, self._before = 0, 0

    def step(self, error: int) -> float:
        """Return the speed for the next millisecond.

        Args:
            error: number of counts to go.
        """
        if abs(error) <= _DEADBAND:
            self.begin()
            return 0.0
        registers = self._registers
        change, self._before = error - self._before, error
        self._sum += error
        wanted = (
            registers["gain_p"] * error / 1e3
            + registers["gain_i"] * self._sum / 1e6
            + registers["gain_d"] * change
        )
        # v = sqrt(2 a s), in counts and milliseconds: the highest speed from which the ramp still
        # stops at the goal.
        braking = sqrt(2 * registers["acceleration_limit"] / 1e6 * abs(error))
        return copysign(min(abs(wanted), braking), wanted)


_INTEGRAL_LIMIT: Final = 10_000.0
"""Limit of the integral in counts, which is our choice."""


class _SpeedLoop(Part):
    """A PID loop on the counts of each millisecond (rh3-control, wheel servo).

    Torque in per mille = VP e + VI sum(e) + VD delta(e), with e in counts/ms. The torque is limited
    to the rated torque. Friction is compensated while the target moves.

    Args:
        registers: registers that hold the gains and limits.

    Attributes:
        reference: target after its ramp, in counts/ms.
        torque: torque of the latest millisecond, in per mille.
        limit: highest speed, in counts/ms.
        counted: number of counts in the latest millisecond.
        stalled_ms: time for which full torque has not moved the wheel.
    """

    def __init__(self, registers: Registers) -> None:
        self.counted = self.stalled_ms = 0
        self.configure(registers)
        self.take_over(0.0)

    def configure(self, registers: Registers) -> None:
        """Read gains and limits from the registers."""
        self._vp, self._vi, self._vd = (registers[f"gain_v{gain}"] for gain in "pid")
        self._ramp = registers["acceleration_limit"] / 1e6
        self.limit = registers["speed_limit"] / 1e3

    def take_over(self, speed: float) -> None:
        """Restart the loop at a speed, so that the motion has no jerk."""
        self.reference, self.torque = speed, 0.0
        self._sum = self._error = self._change = 0.0

    @property
    def settled(self) -> bool:
        """Whether a step towards standstill, where the encoder counts nothing, changes nothing."""
        return not (self.reference or self._error or self._change or self.counted)

    def drive(self, wheel: _Wheel, target: float, steps: int) -> list[float]:
        """Run a wheel under speed control for some milliseconds.

        Args:
            wheel: wheel with its load and faults.
            target: target speed in counts/ms.
            steps: number of milliseconds.

        Returns:
            The speed of the wheel in each millisecond, in counts/ms.
        """
        # one loop over locals takes half the time of a call for each part
        vp, vi, vd, ramp = self._vp, self._vi, self._vd, self._ramp
        load, jammed, friction, agility = wheel.load, wheel.jammed, wheel.friction, wheel.agility
        reference, before, change, torque = self.reference, self._error, self._change, self.torque
        counted, stalled_ms = self.counted, self.stalled_ms
        speed, travel, counts = wheel.speed, wheel.travel, wheel.counts
        speeds: list[float] = []
        for _ in range(steps):
            if target > reference + ramp:
                reference += ramp
            elif target < reference - ramp:
                reference -= ramp
            else:
                reference = target
            error = reference - counted
            change, before = error - before, error
            torque = vp * error + vd * change
            if vi:
                self._sum = min(max(self._sum + error, -_INTEGRAL_LIMIT), _INTEGRAL_LIMIT)
                torque += vi * self._sum
            if reference:
                torque += friction if reference > 0 else -friction
            if not -PER_MILLE <= torque <= PER_MILLE:
                torque = copysign(PER_MILLE, torque)
            net, counted = torque - load, 0
            if jammed or (-_SLOW < speed < _SLOW and -friction <= net <= friction):
                speed = 0.0
            else:
                speed += (net - (friction if (speed or net) > 0 else -friction)) * agility
                travel += speed
                counted, counts = floor(travel) - counts, floor(travel)
            # Encoder counts decide: a wheel that moves less than one count in a millisecond stands
            # still.
            stalled_ms = 0 if counted or abs(torque) < PER_MILLE else stalled_ms + 1
            speeds.append(speed)
        self.reference, self._error, self._change, self.torque = reference, before, change, torque
        self.counted, self.stalled_ms = counted, stalled_ms
        wheel.speed, wheel.travel = speed, travel
        return speeds


STALL_MS: Final = 500
"""Time for which full torque may leave the wheel unmoved, which is our choice."""

_INT32: Final = 2**32


class Side(Part):
    """One side of the base: a wheel, its encoder counter and its servo.

    Args:
        name: `left` or `right`.
        backward_bit: bit of this side in the register `direction`.
        parameters: parameters of the base.
        registers: registers of the driver.

    Attributes:
        name: name of the side: `left` or `right`.
        wheel: mechanics of the wheel.
        fault: reason for which the driver switched this wheel off.
        clipped: whether the target speed was above the limit, so that it was reduced to the limit.
        stalled: whether full torque has not moved the wheel for too long, and the driver has not
            yet reacted to it.
    """

    def __init__(
        self, name: str, backward_bit: int, parameters: BaseParameters, registers: Registers
    ) -> None:
        self.name, self.wheel = name, _Wheel(parameters)
        self._registers, self._backward_bit = registers, backward_bit
        self._speed_loop = _SpeedLoop(registers)
        self._position_loop = _PositionLoop(registers)
        self._rated_ma, self._per_mille, self._zero = parameters.rated_ma, parameters.per_mille, 0
        self.power_up()

    def power_up(self) -> None:
        """Restart at count 0, without a fault."""
        self.fault, self.clipped, self.stalled = Fault(0), False, False
        self._speed_loop.counted = self._speed_loop.stalled_ms = 0
        self._speed, self._goal = 0.0, 0
        self.configure()
        self.take_over()
        self.zero()

    def configure(self) -> None:
        """Read gains and limits from the registers."""
        self._backward = self._registers["direction"] >> self._backward_bit & 1
        self._speed_loop.configure(self._registers)

    def zero(self) -> None:
        """Set the count to 0."""
        self._zero = self.wheel.counts

    def take_over(self) -> None:
        """Switch on at the present speed of the wheel."""
        self._speed_loop.take_over(self.wheel.speed)
        self._position_loop.begin()

    def obey(self, values: Mapping[str, int]) -> None:
        """Apply new targets."""
        if (speed := values.get(f"target_speed_{self.name}")) is not None:
            self._speed = self._signed(speed) / 1e3
        if (goal := values.get(f"target_position_{self.name}")) is not None:
            self._goal = self._signed(goal)

    def stop(self, *, quick: bool) -> None:
        """Set the target to standstill, with or without a ramp."""
        # The register follows, so that a master reads the target that is in force.
        self._speed, self._registers[f"target_speed_{self.name}"] = 0.0, 0
        if quick:
            self._speed_loop.reference = 0.0

    @property
    def measured(self) -> dict[str, Callable[[], int]]:
        """The measured values that a master reads."""
        return {
            f"fault_{self.name}": self._fault_bits,
            f"position_{self.name}": self._position,
            f"speed_{self.name}": self._speed_now,
            f"current_{self.name}": self._current_ma,
        }

    def _fault_bits(self) -> int:
        return int(self.fault)

    def _position(self) -> int:
        return self._signed(self.wheel.counts - self._zero)

    def _speed_now(self) -> int:
        return self._signed(round(self.wheel.speed * 1_000))

    def _current_ma(self) -> int:
        return self._signed(round(self.torque * self._rated_ma / PER_MILLE))

    @property
    def torque(self) -> float:
        """Torque of the motor in per mille of the rated torque."""
        return self._speed_loop.torque

    @property
    def resting(self) -> bool:
        """Whether a step with the same target leaves everything unchanged."""
        loop, wheel = self._speed_loop, self.wheel
        return not (wheel.speed or loop.stalled_ms) and loop.settled and wheel.held(loop.torque)

    @property
    def stalling(self) -> bool:
        """Whether full torque leaves the wheel unmoved."""
        return self._speed_loop.stalled_ms > 0

    def inputs_changed(self, inputs: QuantityBank) -> None:
        """Apply the physical inputs to the wheel."""
        self.wheel.load = self._per_mille(inputs[f"load_{self.name}_nm"])
        self.wheel.jammed = bool(inputs[f"jam_{self.name}"])

    def find_faults(self, inputs: QuantityBank, *, powered: bool) -> None:
        """Check for faults that the electronics detect."""
        if inputs["emergency_stop"]:
            self.fault |= Fault.EMERGENCY_STOP
        if inputs[f"encoder_unplugged_{self.name}"]:
            self.fault |= Fault.ENCODER
        if powered and inputs[f"short_circuit_{self.name}"]:
            self.fault |= Fault.OVER_CURRENT
        if self.stalled:
            self.fault |= Fault.STALL
            self.stalled = False

    def drive(self, steps: int, *, stop: bool, to_position: bool) -> list[float]:
        """Drive the wheel towards its target for some milliseconds.

        Args:
            steps: number of milliseconds. It must be 1 if the target is a position, or while the
                wheel is `stalling`.
            stop: whether the target is standstill. If true, `to_position` has no effect.
            to_position: true if the target is a position, false if the target is a speed.

        Returns:
            The speed of the wheel in each millisecond, in counts/ms.
        """
        loop, wheel, limit = self._speed_loop, self.wheel, self._speed_loop.limit
        if stop:
            wanted = 0.0
        elif to_position:
            wanted = self._position_loop.step(self._goal - (wheel.counts - self._zero))
        else:
            wanted = self._speed
        self.clipped = not -limit <= wanted <= limit
        if self.clipped:
            wanted = limit if wanted > 0 else -limit
        speeds = loop.drive(wheel, wanted, steps)
        self.stalled = loop.stalled_ms >= STALL_MS
        return speeds

    def coast(self, *, shorted: bool) -> list[float]:
        """Run a millisecond without power, or with the motor shorted; return the speed."""
        loop, wheel = self._speed_loop, self.wheel
        # Without power the loop holds no state. When power returns, `take_over` gives it the speed
        # of the wheel, so that the wheel does not jerk.
        loop.take_over(0.0)
        loop.counted = loop.stalled_ms = 0
        self.clipped = False
        if shorted:
            wheel.brake()
        else:
            wheel.step(0.0)
        return [wheel.speed]

    def _signed(self, value: int) -> int:
        """Negate a number if the wheel is configured to run backward, and wrap it to 32 bits."""
        # Only this place handles the direction bits (002Bh): for targets on their way in and for
        # measured values on their way out. The result is cut to 32 bits, because the position
        # register wraps as the counter of a driver does.
        value = -value if self._backward else value
        return (value + _INT32 // 2) % _INT32 - _INT32 // 2
