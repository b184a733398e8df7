"""Objects of the motor core unit Ver. 1.1 (NEDO report, 3.4.43.3, Tables 5 and 6; DECISION K19)."""

from __future__ import annotations

from functools import cache
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.nonvolatile import Nonvolatile
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.motor_core_unit.unit import MotorCoreUnit
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.communication_profile import (
    OFF,
    U8,
    U16,
    U32,
    CommunicationProfile,
    Pdo,
    add_communication,
)
from tickrig.wire.canopen.eds.object_table import ROT, RW, RWW, Element, ObjectTable

NODE_ID: Final = 32
"""Unless another is given."""

I16: Final = DataType.INTEGER16
I32: Final = DataType.INTEGER32

ANALOGUE_IN_AND_OUT: Final = 0x000C_0191
"""Device type: CiA 401, analogue inputs and outputs."""

CHANNELS: Final = 4


def _channels(index: int) -> tuple[int, ...]:
    """Map the four 16-bit channels of an array."""
    return tuple(index << 16 | sub << 8 | I16.bits for sub in range(1, CHANNELS + 1))


PROFILE: Final = CommunicationProfile(
    device_type=ANALOGUE_IN_AND_OUT,
    name="motor core unit",
    hardware="1.1",
    software="tickrig",
    product_code=2,
    rpdos=[Pdo(OFF | 0x200), Pdo(0x300, _channels(0x6411)), Pdo(OFF | 0x400), Pdo(OFF | 0x500)],
    tpdos=[Pdo(OFF | 0x180), Pdo(0x280, _channels(0x6401)), Pdo(OFF | 0x380), Pdo(OFF | 0x480)],
)

make_application: Final = MotorCoreUnit
"""What the unit does with its objects."""


def make_motor_core_unit(
    node_id: int = NODE_ID, nonvolatile: Nonvolatile | None = None
) -> CanopenSlave:
    """Make a motor core unit with its motor.

    Args:
        node_id: 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: what it kept from an earlier life, as stored parameters; nothing if left out.

    Returns:
        A slave that boots in its first tick.

    Raises:
        ValueError: an impossible node-ID.
    """
    slave = make_slave(dictionary(), node_id, nonvolatile, make_application)
    slave.model = "motor-core-unit"
    return slave


def dictionary() -> Dictionary:
    """Return the objects with default values, for one slave; their description is shared."""
    return _template().copy()


@cache
def _template() -> Dictionary:
    objects = ObjectTable()
    add_communication(objects, PROFILE)
    objects.variable(0x2000, "Mode", U8, RW, high=3)
    objects.variable(0x2001, "Status", U16, ROT)
    full_scales = (
        Element(1, "Full scale angle, 0.001 deg", U32, RW, 180_000),
        Element(2, "Full scale velocity, 0.001 deg/s", U32, RW, 360_000),
        Element(3, "Full scale current, mA", U32, RW, 10_000),
    )
    objects.record(0x2010, "Full scale", full_scales)
    objects.variable(0x2011, "Angle offset, 0.001 deg", I32, RW)
    objects.array(0x6401, "Read analogue input 16-bit", CHANNELS, I16, ROT)
    objects.array(0x6411, "Write analogue output 16-bit", CHANNELS, I16, RWW)
    objects.array(0x6443, "Analogue output error mode", 1, U8, RW, 1)
    objects.array(0x6444, "Analogue output error value", 1, I32, RW)
    return Dictionary(objects, objects.objects)
