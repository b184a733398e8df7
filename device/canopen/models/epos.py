"""A positioning drive like Maxon's EPOS 24/5 with a wheel of beego (DECISION K21).

Objects, units and defaults follow the EPOS Firmware Specification where it agrees with CiA 402;
docs/reference/devices/epos.md lists our choices.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import ClassVar, Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds402.actual_values import MEASURES, Measure, statusword_of
from tickrig.device.canopen.ds402.automaton import Bounds
from tickrig.device.canopen.ds402.drive import Ds402
from tickrig.device.canopen.ds402.modes import cyclic as maxon
from tickrig.device.canopen.ds402.modes import modes
from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.settings import ErrorCode
from tickrig.device.canopen.slave import CanopenSlave, Nonvolatile
from tickrig.device.canopen.stack import make_slave
from tickrig.device.servo.parameters import EPOS_WHEEL
from tickrig.device.servo.servo import Servo
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    OFF,
    RO,
    ROT,
    RW,
    RWW,
    U8,
    U16,
    U32,
    CommunicationProfile,
    Element,
    ObjectCode,
    ObjectTable,
    add_communication,
)
from tickrig.wire.canopen.pdo import PdoDescription

NODE_ID: Final = 1
"""Default node-ID. In beego, 1 is the left wheel and 2 is the right wheel."""

_I8: Final = DataType.INTEGER8
_I16: Final = DataType.INTEGER16
_I32: Final = DataType.INTEGER32

_SERVO_DRIVE: Final = 0x0002_0192
"""Device type: CiA 402, servo drive."""

RPM: Final = 0xA4
_I32_MAX: Final = (1 << 31) - 1
_I32_MIN: Final = -(1 << 31)
_NO_LIMIT: Final = 0xFFFF_FFFF

PROFILE: Final = CommunicationProfile(
    device_type=_SERVO_DRIVE,
    name="EPOS",
    hardware="24/5",
    software="tickrig",
    product_code=0x6210,
    rpdos=(
        PdoDescription(0x200, (0x6040_0010, 0x60FF_0020)),
        PdoDescription(0x300, (0x6040_0010, 0x607A_0020)),
        PdoDescription(OFF | 0x400),
        PdoDescription(OFF | 0x500),
    ),
    tpdos=(
        PdoDescription(0x180, (0x6041_0010, 0x6064_0020), inhibit_100us=100),
        PdoDescription(OFF | 0x280, (0x606C_0020, 0x6077_0010, 0x6061_0008), inhibit_100us=100),
        PdoDescription(OFF | 0x380),
        PdoDescription(OFF | 0x480),
    ),
)


@mypyc_attr(allow_interpreted_subclasses=True)
class Epos(Ds402):
    """A Maxon EPOS drive: a CiA 402 drive with Maxon's own modes, units and error codes.

    Velocities are in revolutions of the motor per minute, accelerations in revolutions per minute
    per second, positions in counts of the motor's encoder. Bit 8 of the statusword (offset of the
    motor current measurement is known) is always set. Bit 15 means that the position refers to a
    home position.

    The gains of the control loops, the digital and analogue inputs, the modes "master encoder" and
    "step", and RS232 are not emulated.
    """

    modes: ClassVar[Mapping[int, type[Mode]]] = {**modes.MODES, **maxon.MODES}
    measures: ClassVar[Mapping[int, Measure]] = {
        **MEASURES,
        0x6041: lambda drive: statusword_of(drive) | 0x0100 | 0x8000 * drive.axis.homed,
        0x6078: lambda drive: drive.axis.motor.current_ma,
    }
    bounds: ClassVar[Bounds] = Bounds(supply_mv=(10_000, 30_000))
    encoder_error = ErrorCode.POSITION_SENSOR
    limits_are_faults = True
    more_targets = maxon.SETTINGS


def make_epos(node_id: int = NODE_ID, nonvolatile: Nonvolatile | None = None) -> CanopenSlave:
    """Make an emulated drive like Maxon's EPOS 24/5, as used at a wheel of the robot beego.

    Args:
        node_id: node-ID 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: memory with parameters from an earlier run, or None for empty memory.

    Returns:
        A slave that boots in its first tick.

    Raises:
        ValueError: the node-ID is invalid.
    """
    slave = make_slave(dictionary(), node_id, nonvolatile, make_application)
    slave.model = "epos"
    return slave


def dictionary() -> Dictionary:
    """Return the objects of one slave with default values; slaves share the description."""
    return _template().copy()


@cache
def _template() -> Dictionary:
    objects = ObjectTable()
    add_communication(objects, PROFILE)
    _add_setting_values(objects)
    _add_control(objects)
    _add_options(objects)
    _add_position(objects)
    _add_velocity(objects)
    _add_torque(objects)
    _add_profile(objects)
    _add_homing(objects)
    _add_cyclic(objects)
    return Dictionary(objects, objects.objects)


def make_application(node: CanopenSlave, slot: int) -> Epos:
    """Make the application, for `make_slave`."""
    return Epos(node, slot, Servo(EPOS_WHEEL))


def _add_setting_values(objects: ObjectTable) -> None:
    objects.variable(0x2030, "Current mode setting value", _I16, RWW)
    objects.variable(0x2062, "Position mode setting value", _I32, RWW)
    objects.variable(0x206B, "Velocity mode setting value", _I32, RWW)


def _add_control(objects: ObjectTable) -> None:
    objects.variable(0x603F, "Error code", U16, ROT)
    objects.variable(0x6040, "Controlword", U16, RWW)
    objects.variable(0x6041, "Statusword", U16, ROT)
    objects.variable(0x6060, "Modes of operation", _I8, RWW, 1)
    objects.variable(0x6061, "Modes of operation display", _I8, ROT)
    objects.variable(0x60FD, "Digital inputs", U32, ROT)
    objects.variable(0x6402, "Motor type", U16, RO, 1)
    objects.variable(0x6502, "Supported drive modes", U32, RO, modes.supported(modes.MODES))


def _add_options(objects: ObjectTable) -> None:
    for index, name, default in (
        (0x6007, "Abort connection option code", 1),
        (0x605A, "Quick stop option code", 2),
        (0x605B, "Shutdown option code", 0),
        (0x605C, "Disable operation option code", 1),
        (0x605D, "Halt option code", 1),
        (0x605E, "Fault reaction option code", 2),
    ):
        objects.variable(index, name, _I16, RW, default)


def _add_position(objects: ObjectTable) -> None:
    objects.variable(0x6062, "Position demand value", _I32, ROT)
    objects.variable(0x6063, "Position actual internal value", _I32, ROT)
    objects.variable(0x6064, "Position actual value", _I32, ROT)
    objects.variable(0x6065, "Following error window", U32, RW, 2_000)
    objects.variable(0x6066, "Following error time out", U16, RW)
    objects.variable(0x6067, "Position window", U32, RW, _NO_LIMIT)
    objects.variable(0x6068, "Position window time", U16, RW)
    objects.variable(0x607A, "Target position", _I32, RWW)
    limits = (("Minimal position limit", _I32_MIN), ("Maximal position limit", _I32_MAX))
    rows = [Element(sub, name, _I32, RW, value) for sub, (name, value) in enumerate(limits, 1)]
    objects.record(0x607D, "Software position limit", rows, code=ObjectCode.ARRAY)
    objects.variable(0x607E, "Polarity", U8, RW)
    objects.variable(0x60F4, "Following error actual value", _I32, ROT)
    objects.variable(0x60FC, "Position demand internal value", _I32, ROT)


def _add_velocity(objects: ObjectTable) -> None:
    objects.variable(0x606B, "Velocity demand value", _I32, ROT)
    objects.variable(0x606C, "Velocity actual value", _I32, ROT)
    objects.variable(0x606D, "Velocity window", U16, RW)
    objects.variable(0x606E, "Velocity window time", U16, RW)
    objects.variable(0x606F, "Velocity threshold", U16, RW)
    objects.variable(0x6070, "Velocity threshold time", U16, RW)
    objects.variable(0x608B, "Velocity notation index", _I8, CONST, 0)
    objects.variable(0x608C, "Velocity dimension index", U8, CONST, RPM)
    objects.variable(0x60FF, "Target velocity", _I32, RWW)


def _add_torque(objects: ObjectTable) -> None:
    objects.variable(0x6071, "Target torque", _I16, RWW)
    objects.variable(0x6072, "Max torque", U16, RWW, 2_900)
    objects.variable(0x6073, "Max current", U16, RW, 2_900)
    objects.variable(0x6074, "Torque demand", _I16, ROT)
    objects.variable(0x6075, "Motor rated current", U32, RW, 3_440)
    objects.variable(0x6076, "Motor rated torque", U32, RW, 85)
    objects.variable(0x6077, "Torque actual value", _I16, ROT)
    objects.variable(0x6078, "Current actual value", _I16, ROT)
    objects.variable(0x6079, "DC link circuit voltage", U32, ROT)
    objects.variable(0x6087, "Torque slope", U32, RW, 10_000)
    objects.variable(0x60E0, "Positive torque limit value", U16, RWW, 2_900)
    objects.variable(0x60E1, "Negative torque limit value", U16, RWW, 2_900)


def _add_profile(objects: ObjectTable) -> None:
    objects.variable(0x607F, "Max profile velocity", U32, RW, 25_000)
    objects.variable(0x6080, "Max motor speed", U32, RW, 25_000)
    objects.variable(0x6081, "Profile velocity", U32, RWW, 1_000)
    objects.variable(0x6083, "Profile acceleration", U32, RWW, 10_000)
    objects.variable(0x6084, "Profile deceleration", U32, RWW, 10_000)
    objects.variable(0x6085, "Quick stop deceleration", U32, RW, 10_000)
    objects.variable(0x6086, "Motion profile type", _I16, RW)


def _add_homing(objects: ObjectTable) -> None:
    objects.variable(0x607C, "Home offset", _I32, RW)
    objects.variable(0x6098, "Homing method", _I8, RW, 7)
    speeds = (("Speed for switch search", 100), ("Speed for zero search", 10))
    rows = [Element(sub, name, U32, RW, value) for sub, (name, value) in enumerate(speeds, 1)]
    objects.record(0x6099, "Homing speeds", rows, code=ObjectCode.ARRAY)
    objects.variable(0x609A, "Homing acceleration", U32, RW, 1_000)


def _add_cyclic(objects: ObjectTable) -> None:
    objects.variable(0x60B0, "Position offset", _I32, RWW)
    objects.variable(0x60B1, "Velocity offset", _I32, RWW)
    objects.variable(0x60B2, "Torque offset", _I16, RWW)
    objects.variable(0x60C0, "Interpolation sub mode select", _I16, RW)
    rows = [Element(1, "Interpolation data record 1", _I32, RWW)]
    objects.record(0x60C1, "Interpolation data record", rows, code=ObjectCode.ARRAY)
    rows = [
        Element(1, "Interpolation time period value", U8, RW, 10),
        Element(2, "Interpolation time index", _I8, RW, -3),
    ]
    objects.record(0x60C2, "Interpolation time period", rows)
    objects.variable(0x60C5, "Max acceleration", U32, RW, _NO_LIMIT)
    objects.variable(0x60C6, "Max deceleration", U32, RW, _NO_LIMIT)
