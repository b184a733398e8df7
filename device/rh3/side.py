"""One wheel as its driver sees it: loops, counter and faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tickrig.device.modbus.registers import Registers
from tickrig.device.physical import QuantityBank
from tickrig.device.rh3.parameters import PER_MILLE, BaseParameters
from tickrig.device.rh3.speed_loop import PositionLoop, SpeedLoop
from tickrig.device.rh3.wheel import Wheel
from tickrig.device.twin import Part
from tickrig.wire.modbus.rh3 import Fault

STALL_MS: Final = 500
"""How long full torque may turn nothing; a choice."""

INT32: Final = 2**32


class Side(Part):
    """A wheel, its encoder counter and its servo.

    Args:
        name: `left` or `right`.
        backward_bit: of the register `direction`.
        parameters: of the base.
        registers: of the driver.

    Attributes:
        name: which side it is.
        wheel: the mechanics.
        fault: why it has no power.
        clipped: its target was above the speed limit.
        stalled: full torque has turned nothing for long, and nobody has looked yet.
    """

    def __init__(
        self, name: str, backward_bit: int, parameters: BaseParameters, registers: Registers
    ) -> None:
        self.name, self.wheel = name, Wheel(parameters)
        self._registers, self._backward_bit = registers, backward_bit
        self._speed_loop = SpeedLoop(registers)
        self._position_loop = PositionLoop(registers)
        self._rated_ma, self._per_mille, self._zero = parameters.rated_ma, parameters.per_mille, 0
        self.power_up()

    def power_up(self) -> None:
        """Count from 0, without a fault."""
        self.fault, self.clipped, self.stalled = Fault(0), False, False
        self._speed_loop.counted = self._speed_loop.stalled_ms = 0
        self._speed, self._goal = 0.0, 0
        self.configure()
        self.take_over()
        self.zero()

    def configure(self) -> None:
        """Take over gains and limits."""
        self._backward = self._registers["direction"] >> self._backward_bit & 1
        self._speed_loop.configure(self._registers)

    def zero(self) -> None:
        """Count from 0 on."""
        self._zero = self.wheel.counts

    def take_over(self) -> None:
        """Take power at the speed that the wheel has."""
        self._speed_loop.take_over(self.wheel.speed)
        self._position_loop.begin()

    def obey(self, values: Mapping[str, int]) -> None:
        """Take new targets."""
        if (speed := values.get(f"target_speed_{self.name}")) is not None:
            self._speed = self._signed(speed) / 1e3
        if (goal := values.get(f"target_position_{self.name}")) is not None:
            self._goal = self._signed(goal)

    def stop(self, *, quick: bool) -> None:
        """Want standstill, with or without a ramp."""
        self._speed, self._registers[f"target_speed_{self.name}"] = 0.0, 0
        if quick:
            self._speed_loop.reference = 0.0

    @property
    def measured(self) -> dict[str, Callable[[], int]]:
        """What a master reads of it."""
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
        """Torque of the motor, per mille of the rated one."""
        return self._speed_loop.torque

    @property
    def resting(self) -> bool:
        """Whether a step with the same target would change nothing."""
        loop, wheel = self._speed_loop, self.wheel
        return not (wheel.speed or loop.stalled_ms) and loop.settled and wheel.held(loop.torque)

    @property
    def stalling(self) -> bool:
        """Whether full torque turns nothing."""
        return self._speed_loop.stalled_ms > 0

    def inputs_changed(self, inputs: QuantityBank) -> None:
        """Take over what the world does to the wheel."""
        self.wheel.load = self._per_mille(inputs[f"load_{self.name}_nm"])
        self.wheel.jammed = bool(inputs[f"jam_{self.name}"])

    def find_faults(self, inputs: QuantityBank, *, powered: bool) -> None:
        """Look at what the electronics see."""
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
        """Turn as the targets say; return the speed in each millisecond, counts/ms.

        Args:
            steps: how many milliseconds; 1 towards a position, or while it is `stalling`.
            stop: the target is standstill.
            to_position: the target is a position, else a speed.
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
        """Turn for a millisecond without power, or with the motor shorted; return the speed."""
        loop, wheel = self._speed_loop, self.wheel
        loop.take_over(0.0)
        loop.counted = loop.stalled_ms = 0
        self.clipped = False
        if shorted:
            wheel.brake()
        else:
            wheel.step(0.0)
        return [wheel.speed]

    def _signed(self, value: int) -> int:
        """Turn a number round where the wheel is said to run backward; cut it to 32 bits."""
        value = -value if self._backward else value
        return (value + INT32 // 2) % INT32 - INT32 // 2
