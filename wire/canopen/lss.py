"""LSS codec: node-ID and bit timing over the bus (CiA 305, LSS services).

>>> message(LssCommand.CONFIGURE_NODE_ID, 16).hex()
'1110000000000000'
>>> FastScan.parse(bytes.fromhex("5100000000800000"))
FastScan(id_number=0, bit_check=128, sub=0, next_sub=0)
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Final, NamedTuple

LSS_MASTER_COB_ID: Final = 0x7E5
"""CAN-ID of messages from the LSS master to the slaves."""

LSS_SLAVE_COB_ID: Final = 0x7E4
"""CAN-ID of messages from a slave to the LSS master."""

MESSAGE_BYTES: Final = 8

STANDARD_TABLE: Final = 0
"""Number that selects the bit timing table of CiA 305."""

BIT_RATES: Final = {
    0: 1_000_000,
    1: 800_000,
    2: 500_000,
    3: 250_000,
    4: 125_000,
    6: 50_000,
    7: 20_000,
    8: 10_000,
}
"""Bit rates in bit/s by index of the standard table. Index 5 is reserved, and 9 is automatic
detection."""

FASTSCAN_RESET: Final = 0x80
"""Value of Bit Check that starts a fastscan."""

# cs, four bytes with the low one first, three reserved: 40 9A 02 00 00 00 00 00.
_NUMBER: Final = struct.Struct("<xI3x")
_MESSAGE: Final = struct.Struct("<BI3x")
# 51, IDNumber (4), BitCheck, LSSSub, LSSNext.
_FASTSCAN: Final = struct.Struct("<BIBBB")


class LssCommand(IntEnum):
    """LSS command specifier."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SWITCH_VENDOR = 0x40
    SWITCH_PRODUCT = 0x41
    SWITCH_REVISION = 0x42
    SWITCH_SERIAL = 0x43
    SWITCHED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_PRODUCT = 0x47
    IDENTIFY_REVISION_LOW = 0x48
    IDENTIFY_REVISION_HIGH = 0x49
    IDENTIFY_SERIAL_LOW = 0x4A
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_NON_CONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    NON_CONFIGURED = 0x50
    FASTSCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_PRODUCT = 0x5B
    INQUIRE_REVISION = 0x5C
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


class LssMode(IntEnum):
    """State of an LSS slave, as in Switch State Global."""

    WAITING = 0
    CONFIGURATION = 1


class LssError(IntEnum):
    """Error code in the response to a Configure or Store command."""

    NONE = 0
    OUT_OF_RANGE = 1


class LssAddress(NamedTuple):
    """LSS address, which is the identity object 1018h and unique for each device."""

    vendor: int
    product: int
    revision: int
    serial: int


class FastScan(NamedTuple):
    """A request of LSS fastscan, with which a master searches for slaves without a node-ID.

    Attributes:
        id_number: number with which the slaves compare one part of their LSS address.
        bit_check: lowest compared bit, or 0x80 to restart the search.
        sub: number of the compared part, from 0 (vendor-ID) to 3 (serial number).
        next_sub: number of the part that the next request compares.
    """

    id_number: int
    bit_check: int
    sub: int
    next_sub: int

    @classmethod
    def parse(cls, data: bytes) -> FastScan:
        """Read the eight bytes of a message whose command specifier is already known."""
        return cls(*_FASTSCAN.unpack(data)[1:])

    def encode(self) -> bytes:
        """Return the message."""
        return _FASTSCAN.pack(LssCommand.FASTSCAN, *self)


def message(command: LssCommand, number: int = 0) -> bytes:
    """Return the eight bytes of an LSS message.

    Args:
        command: command specifier.
        number: number of up to 32 bits after the command specifier.
    """
    return _MESSAGE.pack(command, number)


def number_of(data: bytes) -> int:
    """Return the 32-bit number of a message with eight bytes."""
    number: int = _NUMBER.unpack(data)[0]
    return number
