from __future__ import annotations

from tickrig.wire.modbus import Fault, Report, Status


def test_a_report_is_read_from_its_registers() -> None:
    registers = (0x0005, 0x0004, 0x0010, 65_535, 0x0001, 0x0002, 0xFFFF, 0xFFFE, 0, 0, 0, 0)
    assert Report.parse(registers) == Report(
        status=Status.ENABLED | Status.FAULT,
        fault_left=Fault.ENCODER,
        fault_right=Fault.EMERGENCY_STOP,
        sample=65_535,
        left=0x1_0002,
        right=-2,
    )
