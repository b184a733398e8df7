"""f-palette-CANopen: 8 digital inputs, 8 digital outputs, 8 analogue inputs (NEDO report, table 7).

The documents of the module are lost. Channels, node-ID and converter are DECISION K22.
"""

from __future__ import annotations

from functools import cache
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Converter, Ds401
from tickrig.device.canopen.slave import CanopenSlave, Nonvolatile
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    RO,
    ROT,
    RW,
    RWW,
    CommunicationProfile,
    ObjectTable,
    add_communication,
)
from tickrig.wire.canopen.pdo import PdoDescription

NODE_ID: Final = 16
ANALOGUE_INPUTS: Final = 8

_FULL_SCALE_MV: Final = 5_000

ADC: Final = Converter("v", "V", low=0.0, high=_FULL_SCALE_MV / 1_000, high_raw=4095, shift=3)
"""Converter of 12 bit, left-justified in INTEGER16: 0..32760."""

BOOL: Final = DataType.BOOLEAN
U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
I16: Final = DataType.INTEGER16
I32: Final = DataType.INTEGER32

PROFILE: Final = CommunicationProfile(
    device_type=0x0007_0191,
    name="f-palette",
    hardware="K22",
    software="tickrig",
    product_code=1,
    rpdos=(PdoDescription(0x200, (0x6200_0108,)),),
    tpdos=(
        PdoDescription(0x180, (0x6000_0108,)),
        PdoDescription(0x280, (0x6401_0110, 0x6401_0210, 0x6401_0310, 0x6401_0410)),
        PdoDescription(0x380, (0x6401_0510, 0x6401_0610, 0x6401_0710, 0x6401_0810)),
    ),
)


def make_f_palette(node_id: int = NODE_ID, nonvolatile: Nonvolatile | None = None) -> CanopenSlave:
    """Make an emulated I/O module f-palette-CANopen.

    Args:
        node_id: node-ID 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: memory with parameters from an earlier run, or None for empty memory.

    Returns:
        A slave that boots in its first tick.

    Raises:
        ValueError: the node-ID is invalid.
    """
    slave = make_slave(dictionary(), node_id, nonvolatile, make_application)
    slave.model = "f-palette"
    return slave


def dictionary() -> Dictionary:
    """Return the objects of one slave with default values; slaves share the description."""
    return _template().copy()


@cache
def _template() -> Dictionary:
    objects = object_table(PROFILE)
    return Dictionary(objects, objects.objects)


def object_table(profile: CommunicationProfile) -> ObjectTable:
    """Return the objects of the module, with the given communication objects."""
    objects = ObjectTable()
    add_communication(objects, profile)
    _add_digital(objects)
    _add_analogue(objects)
    return objects


def make_application(node: CanopenSlave, slot: int) -> Ds401:
    """Make the application, for `make_slave`."""
    return Ds401(node, slot, inputs=(ADC,) * ANALOGUE_INPUTS)


def _add_digital(objects: ObjectTable) -> None:
    objects.array(0x6000, "Read input 8-bit", 1, U8, ROT)
    objects.array(0x6002, "Polarity input 8-bit", 1, U8, RW)
    objects.array(0x6003, "Filter constant input 8-bit", 1, U8, RW)
    objects.variable(0x6005, "Global interrupt enable digital", BOOL, RW, 1)
    objects.array(0x6006, "Interrupt mask any change 8-bit", 1, U8, RW, 0xFF)
    objects.array(0x6007, "Interrupt mask low to high 8-bit", 1, U8, RW)
    objects.array(0x6008, "Interrupt mask high to low 8-bit", 1, U8, RW)
    objects.array(0x6200, "Write output 8-bit", 1, U8, RWW)
    objects.array(0x6202, "Polarity output 8-bit", 1, U8, RW)
    objects.array(0x6206, "Error mode output 8-bit", 1, U8, RW, 0xFF)
    objects.array(0x6207, "Error value output 8-bit", 1, U8, RW)
    objects.array(0x6208, "Filter mask output 8-bit", 1, U8, RW, 0xFF)


def _add_analogue(objects: ObjectTable) -> None:
    count = ANALOGUE_INPUTS
    objects.variable(0x2000, "Full scale of analogue inputs, mV", U16, CONST, _FULL_SCALE_MV)
    objects.array(0x6401, "Read analogue input 16-bit", count, I16, ROT)
    objects.array(0x6421, "Analogue input interrupt trigger selection", count, U8, RW, 7)
    objects.array(0x6422, "Analogue input interrupt source", 1, U32, RO)
    objects.variable(0x6423, "Analogue input global interrupt enable", BOOL, RW, 0)
    objects.array(0x6424, "Analogue input interrupt upper limit", count, I32, RW)
    objects.array(0x6425, "Analogue input interrupt lower limit", count, I32, RW)
    objects.array(0x6426, "Analogue input interrupt delta", count, U32, RW)
    objects.array(0x6427, "Analogue input interrupt negative delta", count, U32, RW)
    objects.array(0x6428, "Analogue input interrupt positive delta", count, U32, RW)
