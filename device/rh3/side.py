"""One wheel as its driver sees it: loops, counter and faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import floor
from typing import Final

from tickrig.device.modbus.registers import Registers
from tickrig.device.physical import QuantityBank
from tickrig.device.rh3.parameters import PER_MILLE, BaseParameters
from tickrig.device.rh3.speed_loop import PositionLoop, SpeedLoop
from tickrig.device.rh3.wheel import Wheel
from tickrig.device.twin import Part
from tickrig.wire.rh3 import Fault

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
        self._speed_loop = SpeedLoop(registers, self.wheel.friction)
        self._position_loop = PositionLoop(registers)
        self._rated_ma, self._per_mille, self._zero = parameters.rated_ma, parameters.per_mille, 0
        self.power_up()

    def power_up(self) -> None:
        """Count from 0, without a fault."""
        self.fault, self.clipped, self.stalled = Fault(0), False, False
        self._counted = self._stalled_ms = 0
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
        if self.wheel.speed or self._counted or self._stalled_ms:
            return False
        return self._speed_loop.settled and self.wheel.held(self.torque)

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

    def drive(self, *, stop: bool, to_position: bool) -> None:
        """Turn for a millisecond as the targets say."""
        wheel = self.wheel
        if stop:
            wanted = 0.0
        elif to_position:
            wanted = self._position_loop.step(self._goal - (wheel.counts - self._zero))
        else:
            wanted = self._speed
        limit = self._speed_loop.limit
        self.clipped = not -limit <= wanted <= limit
        if self.clipped:
            wanted = limit if wanted > 0 else -limit
        torque = self._speed_loop.step(wanted, self._counted)
        before = floor(wheel.travel)
        wheel.step(torque)
        self._counted = floor(wheel.travel) - before
        if self._counted or abs(torque) < PER_MILLE:
            self._stalled_ms = 0
        else:
            self._stalled_ms += 1
            self.stalled = self._stalled_ms >= STALL_MS

    def coast(self, *, shorted: bool) -> None:
        """Turn for a millisecond without power, or with the motor shorted."""
        self._speed_loop.take_over(0.0)
        self._counted = self._stalled_ms = 0
        self.clipped = False
        if shorted:
            self.wheel.brake()
        else:
            self.wheel.step(0.0)

    def _signed(self, value: int) -> int:
        """Turn a number round where the wheel is said to run backward; cut it to 32 bits."""
        value = -value if self._backward else value
        return (value + INT32 // 2) % INT32 - INT32 // 2
