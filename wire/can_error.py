"""Error states of a CAN controller, and error frames in candump notation.

>>> str(NO_ACK)
'20000020#0000000000000000'
>>> ErrorFrame.parse("20000088#0000010000000000").error_class
136
"""

from __future__ import annotations

import re
from enum import IntEnum
from typing import Final, NamedTuple

from tickrig.wire.errors import FramingError

ERROR_FLAG: Final = 0x2000_0000
"""Marks an identifier as that of an error frame (linux/can.h, CAN_ERR_FLAG)."""

ERROR_CLASS_MASK: Final = 0x1FFF_FFFF

_NOTATION: Final = re.compile(r"([23][0-9A-Fa-f]{7})#([0-9A-Fa-f]{16})")


class ErrorState(IntEnum):
    """State of fault confinement (ISO 11898-1)."""

    ACTIVE = 0
    PASSIVE = 1
    BUS_OFF = 2


class ErrorFrame(NamedTuple):
    """An error frame as SocketCAN tells it (linux/can/error.h).

    Attributes:
        error_class: what failed, a set of CAN_ERR_ bits.
        data: eight bytes that say more.
    """

    error_class: int
    data: bytes = bytes(8)

    @classmethod
    def parse(cls, text: str) -> ErrorFrame:
        """Read candump's notation; FramingError if it is no error frame."""
        match = _NOTATION.fullmatch(text)
        if match is None:
            raise FramingError(f"{text!r} is not an error frame like {NO_ACK}")
        return cls(int(match[1], 16) & ERROR_CLASS_MASK, bytes.fromhex(match[2]))

    def __str__(self) -> str:
        """Write candump's notation."""
        return f"{ERROR_FLAG | self.error_class:08X}#{self.data.hex().upper()}"


NO_ACK: Final = ErrorFrame(0x20)
"""Nobody acknowledged a frame: CAN_ERR_ACK."""

BIT_ERROR: Final = ErrorFrame(0x88, bytes((0, 0, 1, 0, 0, 0, 0, 0)))
"""A bit on the bus was not the one that was sent: CAN_ERR_PROT and BUSERROR, PROT_BIT."""
