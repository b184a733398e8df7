"""The EDS of a drive as drives of robots have it: four modes, and most values left to the master.

`python -m tests.emulators.canopen.bus_file.joint_sheet` writes that of the examples.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.eds.object_table import (
    BIT_RATES,
    OFF,
    RO,
    ROT,
    RW,
    RWW,
    CommunicationProfile,
    DeviceInfo,
    Element,
    ObjectCode,
    ObjectTable,
    add_communication,
)
from tickrig.wire.canopen.pdo import PdoDescription

FOUR_MODES: Final = 0b1010_0101
"""6502h: pp, pv, hm, csp."""

U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
I8, I16, I32 = DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32

PROFILE: Final = CommunicationProfile(
    device_type=0x0002_0192,
    name="Joint",
    hardware="1",
    software="1",
    product_code=0x4A,
    rpdos=tuple(PdoDescription(OFF | 0x200 + 0x100 * n, (0x6040_0010,)) for n in range(4)),
    tpdos=tuple(PdoDescription(OFF | 0x180 + 0x100 * n, (0x6041_0010,)) for n in range(4)),
)


def joint_sheet(modes: int = FOUR_MODES) -> str:
    """Return the text of the EDS.

    Args:
        modes: what 6502h lists.
    """
    objects = ObjectTable()
    add_communication(objects, PROFILE)
    objects.variable(0x2000, "Place in the robot", U32, RW)
    for index, name, kind in (
        (0x6041, "Statusword", U16),
        (0x6061, "Modes of operation display", I8),
        (0x6062, "Position demand value", I32),
        (0x6063, "Position actual internal value", I32),
        (0x6064, "Position actual value", I32),
        (0x606C, "Velocity actual value", I32),
        (0x60FD, "Digital inputs", U32),
    ):
        objects.variable(index, name, kind, ROT)
    for index, name, kind in (
        (0x6040, "Controlword", U16),
        (0x6060, "Modes of operation", I8),
        (0x607A, "Target position", I32),
        (0x60FF, "Target velocity", I32),
    ):
        objects.variable(index, name, kind, RWW)
    for index, name, kind in (
        (0x605A, "Quick stop option code", I16),
        (0x605D, "Halt option code", I16),
        (0x6065, "Following error window", U32),
        (0x6067, "Position window", U32),
        (0x6068, "Position window time", U16),
        (0x607C, "Home offset", I32),
        (0x6081, "Profile velocity", U32),
        (0x6083, "Profile acceleration", U32),
        (0x6084, "Profile deceleration", U32),
        (0x6085, "Quick stop deceleration", U32),
        (0x6098, "Homing method", I8),
        (0x609A, "Homing acceleration", U32),
        (0x60B0, "Position offset", I32),
        (0x60B1, "Velocity offset", I32),
    ):
        objects.variable(index, name, kind, RW)
    objects.variable(0x6502, "Supported drive modes", U32, RO, modes)
    _add_records(objects)
    info = DeviceInfo("tickrig", "Joint", bit_rates=BIT_RATES)
    return _without_values(write_eds(objects, info))


def _add_records(objects: ObjectTable) -> None:
    limits = [
        Element(1, "Minimal position limit", I32, RW, -(1 << 31)),
        Element(2, "Maximal position limit", I32, RW, (1 << 31) - 1),
    ]
    objects.record(0x607D, "Software position limit", limits, code=ObjectCode.ARRAY)
    resolution = [
        Element(1, "Encoder increments", U32, RW),
        Element(2, "Motor revolutions", U32, RO, 1),
    ]
    objects.record(0x608F, "Position encoder resolution", resolution)
    speeds = [
        Element(1, "Speed during search for switch", U32, RW),
        Element(2, "Speed during search for zero", U32, RW),
    ]
    objects.record(0x6099, "Homing speeds", speeds, code=ObjectCode.ARRAY)
    period = [
        Element(1, "Interpolation time period value", U8, RW, 1),
        Element(2, "Interpolation time index", I8, RW, -2),
    ]
    objects.record(0x60C2, "Interpolation time period", period)


def _without_values(text: str) -> str:
    """Leave the values of what the master configures empty, as most drives' files do."""
    head, *objects = text.split("\n[6")
    emptied = (re.sub(r"(?m)^DefaultValue=0(x0+)?$", "DefaultValue=", each) for each in objects)
    return "\n[6".join([head, *emptied]) + "\n"


if __name__ == "__main__":
    ROOT = Path(__file__).parents[4]
    (ROOT / "examples/ros2_canopen/joint.eds").write_text(joint_sheet(), newline="\n")
