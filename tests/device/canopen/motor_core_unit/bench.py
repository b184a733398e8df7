"""A motor core unit alone with the test."""

from __future__ import annotations

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.models import motor_core_unit
from tickrig.device.canopen.models.motor_core_unit import MotorCoreUnit
from tickrig.device.canopen.slave import TICK_US
from tickrig.device.canopen.stack import make_slave

FREE, CURRENT, VELOCITY, ANGLE = range(4)
ON, REACHED, LIMITED, FAULT = 1, 2, 4, 8

START, STOP, PRE_OPERATIONAL, RESET = "000#0120", "000#0220", "000#8020", "000#8120"


class UnitBench(Bus):
    """Steps the unit; time without traffic passes as a rig lets it pass.

    Attributes:
        log: what the unit has sent, each frame with its tick.
    """

    def __init__(self) -> None:
        application = motor_core_unit.make_application
        node_id = motor_core_unit.NODE_ID
        super().__init__(make_slave(motor_core_unit.dictionary(), node_id, application=application))
        self.unit = MotorCoreUnit.of(self.slave)
        self.log: list[tuple[int, str]] = []
        self.send()

    @property
    def heard(self) -> list[str]:
        return [text for _, text in self.log]

    @property
    def status(self) -> int:
        return self.read(0x2001)

    @property
    def emergencies(self) -> list[str]:
        """Code and error register of each EMCY so far."""
        return [text[4:10] for text in self.heard if text.startswith("0A0#")]

    def send(self, *texts: str) -> None:
        """Run one tick with these frames."""
        self.log += ((self.now_us, text) for text in self.step(*texts))

    def pass_ms(self, ms: int) -> None:
        """Let time pass; ticks without work are left out."""
        end_us = self.now_us + ms * TICK_US
        while (due_us := max(self.slave.due_us, self.now_us + TICK_US)) <= end_us:
            self.now_us = (-(-due_us // TICK_US) - 1) * TICK_US
            self.send()
        self.now_us = end_us

    def write(self, index: int, value: int, sub: int = 0) -> None:
        """Write an object as an SDO does; it counts in the next tick."""
        entry = self.slave.dictionary[index, sub]
        entry.download(entry.data_type.encode(value))

    def read(self, index: int, sub: int = 0) -> int:
        return self.slave.dictionary[index, sub].number

    def set(self, name: str, value: float) -> None:
        self.unit.inputs.set(name, value)

    def see(self, name: str) -> float:
        value = self.unit.read(name)
        assert not isinstance(value, str)
        return value

    def begin(self, mode: int, reference: int = 0) -> None:
        """Be Operational in a mode."""
        self.send(START)
        self.refer(reference)
        self.write(0x2000, mode)
        self.pass_ms(2)

    def refer(self, reference: int, velocity_limit: int = 0, current_limit: int = 0) -> None:
        """Send RPDO2."""
        numbers = (reference, velocity_limit, current_limit, 0)
        data = b"".join(number.to_bytes(2, "little", signed=True) for number in numbers)
        self.send(f"320#{data.hex().upper()}")
