"""Error states of a CAN controller, and error frames in candump notation and in words.

>>> str(NO_ACK)
'20000020#0000000000000000'
>>> ErrorFrame.parse("20000088#0000010000000000").error_class
136
>>> describe_error_frame(ErrorFrame.parse("20000004#0020000000006000"))
'controller: transmitter passive'
>>> describe_error_frame(ErrorFrame.parse("20000088#0000040000000000"))
'protocol: bit stuffing, bus error'
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import IntEnum, IntFlag
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
    """An error frame of SocketCAN (linux/can/error.h).

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


class ErrorClass(IntFlag):
    """Bits of the identifier of an error frame (linux/can/error.h)."""

    TRANSMIT_TIMEOUT = 0x001
    LOST_ARBITRATION = 0x002
    CONTROLLER = 0x004
    PROTOCOL = 0x008
    TRANSCEIVER = 0x010
    NO_ACK = 0x020
    BUS_OFF = 0x040
    BUS_ERROR = 0x080
    RESTARTED = 0x100
    COUNTERS = 0x200
    """Bytes 6 and 7 are TEC and REC."""


class ControllerFlag(IntFlag):
    """Bits of byte 1, with `ErrorClass.CONTROLLER`."""

    RECEIVE_OVERFLOW = 0x01
    TRANSMIT_OVERFLOW = 0x02
    RECEIVE_WARNING = 0x04
    TRANSMIT_WARNING = 0x08
    RECEIVE_PASSIVE = 0x10
    TRANSMIT_PASSIVE = 0x20
    ACTIVE = 0x40


class ProtocolFlag(IntFlag):
    """Bits of byte 2, with `ErrorClass.PROTOCOL`."""

    BIT = 0x01
    FORM = 0x02
    STUFFING = 0x04
    DOMINANT = 0x08
    RECESSIVE = 0x10
    OVERLOAD = 0x20
    ACTIVE = 0x40
    TRANSMITTING = 0x80


CONTROLLER_BYTE: Final = 1
PROTOCOL_BYTE: Final = 2
TEC_BYTE: Final = 6
REC_BYTE: Final = 7

_CLASSES: Final[Mapping[int, str]] = {
    ErrorClass.TRANSMIT_TIMEOUT: "transmit time-out",
    ErrorClass.LOST_ARBITRATION: "lost arbitration",
    ErrorClass.CONTROLLER: "controller",
    ErrorClass.PROTOCOL: "protocol",
    ErrorClass.TRANSCEIVER: "transceiver",
    ErrorClass.NO_ACK: "no acknowledge",
    ErrorClass.BUS_OFF: "bus-off",
    ErrorClass.BUS_ERROR: "bus error",
    ErrorClass.RESTARTED: "restarted",
}
_CONTROLLER: Final[Mapping[int, str]] = {
    ControllerFlag.RECEIVE_OVERFLOW: "receive buffer overflow",
    ControllerFlag.TRANSMIT_OVERFLOW: "transmit buffer overflow",
    ControllerFlag.RECEIVE_WARNING: "receiver warning",
    ControllerFlag.TRANSMIT_WARNING: "transmitter warning",
    ControllerFlag.RECEIVE_PASSIVE: "receiver passive",
    ControllerFlag.TRANSMIT_PASSIVE: "transmitter passive",
    ControllerFlag.ACTIVE: "active again",
}
_PROTOCOL: Final[Mapping[int, str]] = {
    ProtocolFlag.BIT: "single bit",
    ProtocolFlag.FORM: "frame format",
    ProtocolFlag.STUFFING: "bit stuffing",
    ProtocolFlag.DOMINANT: "no dominant bit",
    ProtocolFlag.RECESSIVE: "no recessive bit",
    ProtocolFlag.OVERLOAD: "overload",
    ProtocolFlag.ACTIVE: "active error announced",
    ProtocolFlag.TRANSMITTING: "while transmitting",
}
_DETAILS: Final = {
    ErrorClass.CONTROLLER: (CONTROLLER_BYTE, _CONTROLLER),
    ErrorClass.PROTOCOL: (PROTOCOL_BYTE, _PROTOCOL),
}


def describe_error_frame(frame: ErrorFrame) -> str:
    """Return what an error frame says, in words.

    >>> describe_error_frame(ErrorFrame(0x240)), describe_error_frame(ErrorFrame(0))
    ('bus-off', 'unknown')
    """
    words = [_name(bit, text, frame.data) for bit, text in _CLASSES.items() if _has(frame, bit)]
    return ", ".join(words) or "unknown"


def _has(frame: ErrorFrame, bit: int) -> bool:
    return bool(frame.error_class & bit)


def _name(bit: int, text: str, data: bytes) -> str:
    place, texts = _DETAILS.get(ErrorClass(bit), (0, {}))
    details = [detail for flag, detail in texts.items() if data[place] & flag]
    return f"{text}: {' and '.join(details)}" if details else text
