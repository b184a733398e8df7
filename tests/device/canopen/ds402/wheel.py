"""An EPOS with its wheel on the bench: objects by index, time by milliseconds."""

from __future__ import annotations

from collections.abc import Callable

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.slave import CanopenSlave, ServiceMaker
from tickrig.device.canopen.stack import make_slave
from tickrig.device.servo.parameters import EPOS_WHEEL
from tickrig.device.servo.servo import Servo
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.drive import DriveState
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

TURN = 2_000
"""Counts of the motor's encoder."""

COUNTS_PER_DEG = 51 * TURN / 360
"""Of the output shaft."""

RPM = TURN / 60
"""Counts per second."""

REACHED, BIT_12, BIT_13 = 0x0400, 0x1000, 0x2000
INTERNAL_LIMIT = 0x0800


class Lenient(epos.Epos):
    """Its limit switches stop it, and that is all."""

    limits_are_faults = False


def make_lenient(node: CanopenSlave, slot: int) -> Lenient:
    return Lenient(node, slot, Servo(EPOS_WHEEL))


class Wheel(Bus):
    def __init__(self, application: ServiceMaker = epos.make_application) -> None:
        plain, access = epos.dictionary(), Access.READ | Access.WRITE
        end_velocity = EntryDescription(0x6082, 0, "End velocity", DataType.UNSIGNED32, access)
        dictionary = Dictionary([*plain.description, end_velocity], plain.objects)
        super().__init__(make_slave(dictionary, 1, application=application))
        self.drive = epos.Epos.of(self.slave)
        self.step()

    def write(self, index: int, value: int, sub: int = 0) -> None:
        entry = self.slave.dictionary[index, sub]
        entry.download(entry.data_type.encode(value))

    def read(self, index: int, sub: int = 0) -> int:
        return self.slave.dictionary[index, sub].number

    def set(self, **inputs: float) -> None:
        for name, value in inputs.items():
            self.drive.inputs.set(name, value)

    def control(self, *controlwords: int) -> int:
        for controlword in controlwords:
            self.write(0x6040, controlword)
            self.step()
        return self.read(0x6041)

    def enable(self, mode: int) -> None:
        self.write(0x6060, mode)
        self.control(0x06, 0x07, 0x0F)
        assert self.drive.state is DriveState.OPERATION_ENABLED

    @property
    def bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword."""
        return self.read(0x6041) & (REACHED | BIT_12 | BIT_13)

    def run_until(self, done: Callable[[], bool], limit_ms: int = 10_000) -> int:
        """Run until something holds; return for how many ms."""
        for passed_ms in range(limit_ms):
            if done():
                return passed_ms
            self.step()
        raise AssertionError(f"not within {limit_ms} ms")
