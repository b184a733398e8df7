r"""CAN and CAN FD frames: candump notation, length on the bus, error frames, logs.

>>> str(CanFrame.parse("705#7F")), str(CanFrame.parse("705#R1"))
('705#7F', '705#R1')
>>> CanFrame.parse("00000605#40").extended
True

The length of a classic CAN frame on the bus, to the bit.

A node sends the bit stream from start of frame to the end of the CRC with bit stuffing: after five
equal bits it inserts one bit of the other value. The inserted bit counts as the first of the next
run (ISO 11898-1, bit stuffing). The rest of the frame has a fixed form: CRC delimiter, ACK slot,
ACK delimiter, seven bits end of frame and three bits interframe space.

>>> frame_bits(CanFrame.parse("705#7F")), frame_bits(CanFrame.parse("000#"))
(58, 53)

CAN FD frames, their candump notation, and their length on the bus.

>>> frame = FdFrame.parse("123##1" + "AA" * 9)
>>> frame.brs, len(frame.data), frame.dlc, str(frame)
(True, 12, 9, '123##1AAAAAAAAAAAAAAAAAA000000')
>>> fd_bits(FdFrame.parse("123##1AABB")), fd_bits(FdFrame.parse("123##0AABB"))
(FdBits(nominal=30, fast=48), FdBits(nominal=79, fast=0))

Error states of a CAN controller, and error frames in candump notation and in words.

>>> str(NO_ACK)
'20000020#0000000000000000'
>>> ErrorFrame.parse("20000088#0000010000000000").error_class
136
>>> describe_error_frame(ErrorFrame.parse("20000004#0020000000006000"))
'controller: transmitter passive'
>>> describe_error_frame(ErrorFrame.parse("20000088#0000040000000000"))
'protocol: bit stuffing, bus error'

Text of a CAN log, as `candump -L` writes it and `canplayer` reads it.

>>> line = LogLine(10_000, "vcan0", CanFrame.parse("705#7F"))
>>> str(line)
'(0000000000.010000) vcan0 705#7F'
>>> parse_log(f"{line}\n") == (line,)
True
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Mapping
from enum import IntEnum, IntFlag
from functools import lru_cache, reduce
from operator import getitem
from typing import Any, Final, NamedTuple

import crcmod

from tickrig.wire.errors import FieldError, FramingError, WireError

MAX_DATA_BYTES: Final = 8
STANDARD_MAX: Final = 0x7FF
EXTENDED_MAX: Final = 0x1FFF_FFFF

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?:(R)([0-8])?|((?:[0-9A-Fa-f]{2}\.?)*))"
)


class CanFrame(NamedTuple):
    """A classic CAN frame, either a data frame or a remote frame.

    For speed the values are not validated when a frame is made; see `checked`.

    Attributes:
        can_id: identifier, 0x000..0x7FF, or 0x0000_0000..0x1FFF_FFFF if extended.
        data: payload of 0 to 8 bytes, which is empty in a remote frame.
        remote: whether the frame is a remote frame (RTR).
        extended: whether the identifier has 29 bits.
        remote_length: DLC of a remote frame.
    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    remote_length: int = 0

    @property
    def dlc(self) -> int:
        """The data length code."""
        return self.remote_length if self.remote else len(self.data)

    @classmethod
    def parse(cls, text: str) -> CanFrame:
        """Parse a frame in candump's compact notation, such as `123#AABB`.

        Args:
            text: frame as `ID#DATA`, or as `ID#R` with an optional length. An ID with 8 digits is
                29-bit.

        Returns:
            The frame.

        Raises:
            FramingError: the text is not a frame in this notation.
            FieldError: an identifier or length is out of range.
        """
        match = _NOTATION.fullmatch(text.strip())
        if match is None:
            raise FramingError(f"{text!r} is not a frame like 705#7F, 705#R1 or 00000605#40")
        can_id, remote, length, data = match.groups()
        frame = cls(
            int(can_id, 16),
            bytes.fromhex((data or "").replace(".", "")),
            bool(remote),
            len(can_id) == 8,
            int(length or 0),
        )
        return frame.checked()

    def checked(self) -> CanFrame:
        """Check that identifier and data are valid, and return the frame itself.

        Returns:
            The frame itself.

        Raises:
            FieldError: the frame is not a valid CAN frame.
        """
        most = EXTENDED_MAX if self.extended else STANDARD_MAX
        if not 0 <= self.can_id <= most:
            raise FieldError(f"CAN-ID 0x{self.can_id:X} is not {29 if self.extended else 11}-bit")
        if len(self.data) > MAX_DATA_BYTES or not 0 <= self.remote_length <= MAX_DATA_BYTES:
            raise FieldError(f"a frame of {self.dlc} bytes, at most 8 fit")
        if self.remote and self.data:
            raise FieldError("a remote frame carries no data")
        return self

    def __str__(self) -> str:
        """Write candump's compact notation."""
        can_id = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        if self.remote:
            return f"{can_id}#R{self.remote_length or ''}"
        return f"{can_id}#{self.data.hex().upper()}"


def data_frame(can_id: int, data: bytes) -> CanFrame:
    """Return `CanFrame(can_id, data)` in a third of the time: 11-bit, not validated."""
    return _new(_FRAME, (can_id, data, False, False, 0))


_new: Final = tuple.__new__
_FRAME: Final = CanFrame  # mypyc finds it without a look-up

Frames = tuple[CanFrame, ...]
"""The traffic of one tick on a CAN bus."""


# How `frame_bits` counts without reading single bits.
#
# From start of frame to the end of the CRC, a frame consists of bits with bit stuffing: a bit of
# the other value is inserted after five equal ones. A fixed tail follows. The number of stuff bits
# depends on all bits before the tail. An automaton of eight states reads the bits. Its state is the
# value of the last bit and the length of its run, 1 to 4. A ninth and a tenth state begin a frame
# in the middle of a byte, because eleven or 29 bits of identifier do not fill bytes. SOF,
# identifier and control field are put together so that they end on a byte, and the zeros that fill
# the front are skipped.
#
# `_fed_bytes` computes the effect of each byte on each state. `_rows` turns the results into lists
# that refer to each other, one set for each possible number of stuff bits (at most 29). Following a
# byte is then one index into a list, and `reduce(getitem, data, row)` follows all bytes in C. The
# last row that it reaches holds the number at its end. `_head` caches the state of a frame after
# its DLC, because the same identifiers occur repeatedly. The CRC of 15 bits is fed like data, with
# one additional bit that differs from the last bit of the CRC and so never completes a run itself.
#
# tests/wire/test_can_bits.py, which counts single bits, checks changes to this code. `fd_bits` uses
# the same automaton for the data. In the CRC field of CAN FD the stuff bits are at fixed places.
INTERFRAME_BITS: Final = 3
"""Number of bits of the interframe space (intermission), which `frame_bits` includes."""

_CRC_POLYNOMIAL: Final = 0x4599
"""Polynomial of the CRC: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1 (ISO 11898-1)."""

# The generator times x: the CRC of 15 bits is in the upper bits of 16, so whole bytes can be fed.
# Zeros before a stream change nothing, because the seed is 0.
_crc16 = crcmod.mkCrcFun(1 << 16 | _CRC_POLYNOMIAL << 1, initCrc=0, rev=False, xorOut=0)

# For 11 bits: SOF, identifier, RTR IDE r0, DLC, CRC, then CRC delimiter, ACK slot and delimiter and
# the seven bits of end of frame. For 29 bits: additionally 18 bits of the identifier, SRR and r1.
STANDARD_BITS: Final = 1 + 11 + 3 + 4 + 15 + 10 + INTERFRAME_BITS
EXTENDED_BITS: Final = STANDARD_BITS + 20
"""Number of bits of an empty frame without stuff bits."""
EXTENDED_FLAGS: Final = 0b11  # SRR and IDE, both recessive

# States of the stuffing automaton: value of the latest bit << 2 | length of its run - 1. A stuff
# bit ends a run of five at once. Two more states begin a frame: they skip the zeros that fill its
# first byte.
START_STANDARD: Final = 8
START_EXTENDED: Final = 9
_FILL_BITS: Final = {START_STANDARD: 5, START_EXTENDED: 1}
_STATES: Final = 10

_MAX_STUFFED: Final = 29
"""Largest number of stuff bits for the 118 bits from start of frame to the CRC's end: (118 - 1) //
4."""

_STUFFED_BITS: Final = 256
"""Position of the number of stuff bits in a row; the next rows are before this position."""

KEPT_HEADS: Final = 4_096

_Row = list[Any]

_heads: Final[dict[int, tuple[int, _Row, int]]] = {}
"""Cache of frame heads. It is a plain dict, because the order that `lru_cache` keeps costs 1 %."""


def frame_bits(frame: CanFrame) -> int:
    """Return the number of bits of a frame, with stuff bits and interframe space."""
    data = frame[1]  # places, not names: all five at once would take longer than these
    key = frame[0] << 6 | len(data)
    if frame[2] or frame[3]:
        key |= frame[3] << 5 | frame[2] << 4 | frame[4]
    bits, row, crc = _heads.get(key) or _head(key)
    crc = _crc16(data, crc)
    row = reduce(getitem, data, row)
    # After the CRC one bit that differs from its last one: it fills the byte, and is never stuffed.
    end: int = row[crc >> 8][crc & 0xFE | ~crc >> 1 & 1][_STUFFED_BITS]
    return bits + end


kept_bits: Final = lru_cache(KEPT_HEADS)(frame_bits)
"""`frame_bits` with a cache, because each bus and each meter of its load counts the same frame.

The frame's data must be `bytes`: a slave may send a `bytearray`, which has no hash.
"""


def _head(key: int) -> tuple[int, _Row, int]:
    """Return the number of bits of a frame without stuff bits, and row and CRC after the DLC."""
    can_id, extended, remote, length = key >> 6, key >> 5 & 1, key >> 4 & 1, key & 0xF
    control = remote << 6 | length
    if extended:
        arbitration = (can_id >> 18) << 20 | EXTENDED_FLAGS << 18 | can_id & 0x3_FFFF
        stream, bits = (arbitration << 7 | control).to_bytes(5, "big"), EXTENDED_BITS
    else:
        stream, bits = (can_id << 7 | control).to_bytes(3, "big"), STANDARD_BITS
    first = _rows()[START_EXTENDED if extended else START_STANDARD]
    data_bits = 0 if remote else 8 * length
    if len(_heads) >= KEPT_HEADS:
        _heads.clear()
    head = bits + data_bits, reduce(getitem, stream, first), _crc16(stream)
    _heads[key] = head
    return head


@lru_cache(1)
def _rows() -> list[_Row]:
    """Build the table of the automaton, which handles a whole byte in one step.

    Returns:
        The rows by initial state. Each row holds the next row for each byte, and at `_STUFFED_BITS`
        the number of stuff bits inserted so far.
    """
    steps = [stuffed * _STATES + (state >> 8) for stuffed, state in zip(STUFFED, NEXT, strict=True)]
    rows: list[_Row] = [[] for _ in range(_STATES * (_MAX_STUFFED + 1) + max(steps))]
    for stuffed in range(_MAX_STUFFED + 1):
        first = stuffed * _STATES
        for state in range(_STATES):
            row = rows[first + state]
            row += [rows[first + step] for step in steps[state << 8 : state + 1 << 8]]
            row.append(stuffed)
    return rows


def crc16(stream: bytes) -> int:
    """Return the CRC of a bit stream, times two.

    >>> crc16(bytes([1])) == _CRC_POLYNOMIAL << 1
    True
    """
    crc: int = _crc16(stream)
    return crc


def _fed(state: int, bits: int) -> list[tuple[int, int]]:
    """Return for each value of a few more bits the next state, and the number of stuffed bits."""
    # last bit, length of its run, stuffed bits; a frame begins without a last bit
    ends = [(state >> 2, (state & 3) + 1 if state not in _FILL_BITS else 0, 0)]
    for _ in range(bits):
        ends = [_follow(end, bit) for end in ends for bit in (0, 1)]
    return [(last << 2 | run - 1, stuffed) for last, run, stuffed in ends]


def _follow(end: tuple[int, int, int], bit: int) -> tuple[int, int, int]:
    last, run, stuffed = end
    run = run + 1 if bit == last else 1
    return (bit, run, stuffed) if run < 5 else (1 - bit, 1, stuffed + 1)


def _fed_bytes() -> list[tuple[int, int]]:
    """Return by state << 8 | byte the next state, and the number of stuffed bits."""
    halves = [_fed(state, 4) for state in range(START_STANDARD)]
    fed = [
        (after, first + second)
        for half in halves
        for between, first in half
        for after, second in halves[between]
    ]
    for state, fill in _FILL_BITS.items():
        fed += _fed(state, 8 - fill) * (1 << fill)
    return fed


_FED: Final = _fed_bytes()
NEXT: Final = tuple(state << 8 for state, _ in _FED)
"""Next state << 8, by state << 8 | byte."""
STUFFED: Final = tuple(stuffed for _, stuffed in _FED)
"""Number of stuffed bits, by state << 8 | byte."""


MAX_FD_BYTES: Final = 64
FD_LENGTHS: Final = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Number of data bytes by data length code (ISO 11898-1)."""

BRS: Final = 0x1
ESI: Final = 0x2
"""Flags of a CAN FD frame (linux/can.h, CANFD_BRS and CANFD_ESI)."""

_FD_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})##([0-9A-Fa-f])((?:[0-9A-Fa-f]{2}\.?)*)"
)


class FdFrame(NamedTuple):
    """A CAN FD frame, which is always a data frame.

    The values are not validated when a frame is made; see `checked`.

    Attributes:
        can_id: identifier, 0x000..0x7FF, or 0x0000_0000..0x1FFF_FFFF if extended.
        data: payload, whose number of bytes is one of `FD_LENGTHS`.
        extended: whether the identifier has 29 bits.
        flags: flags `BRS` and `ESI`.
    """

    can_id: int
    data: bytes = b""
    extended: bool = False
    flags: int = 0

    @property
    def brs(self) -> bool:
        """Whether the data are sent at the data bit rate (bit rate switch)."""
        return bool(self.flags & BRS)

    @property
    def esi(self) -> bool:
        """Whether the sender was error passive (error state indicator)."""
        return bool(self.flags & ESI)

    @property
    def remote(self) -> bool:
        """False, because CAN FD has no remote frames."""
        return False

    @property
    def dlc(self) -> int:
        """The data length code, 0 to 15."""
        return bisect_left(FD_LENGTHS, len(self.data))

    @classmethod
    def parse(cls, text: str) -> FdFrame:
        """Parse a frame in candump's compact notation for CAN FD, such as `123##1AABB`.

        Args:
            text: frame as `ID##FDATA`. F is one hex digit: 1 means BRS, 2 means ESI, and other
                flags are ignored. An ID with 8 digits is 29-bit. Data are padded as in `checked`.

        Returns:
            The frame.

        Raises:
            FramingError: the text is not a frame in this notation.
            FieldError: an identifier or length is out of range.
        """
        match = _FD_NOTATION.fullmatch(text.strip())
        if match is None:
            raise FramingError(f"{text!r} is not a CAN FD frame like 123##1AABB")
        can_id, flags, data = match.groups()
        frame = cls(
            int(can_id, 16),
            bytes.fromhex(data.replace(".", "")),
            len(can_id) == 8,
            int(flags, 16) & (BRS | ESI),
        )
        return frame.checked()

    def checked(self) -> FdFrame:
        """Check that identifier and data are valid, and return the frame with a valid length.

        Returns:
            The frame. Data of an invalid length are padded with zeros to the next valid length, as
            a controller does.

        Raises:
            FieldError: the frame is not a valid CAN FD frame.
        """
        most = EXTENDED_MAX if self.extended else STANDARD_MAX
        if not 0 <= self.can_id <= most:
            raise FieldError(f"CAN-ID 0x{self.can_id:X} is not {29 if self.extended else 11}-bit")
        if len(self.data) > MAX_FD_BYTES:
            raise FieldError(f"a CAN FD frame of {len(self.data)} bytes, at most 64 fit")
        length = FD_LENGTHS[self.dlc]
        if length == len(self.data):
            return self
        return self._replace(data=self.data.ljust(length, b"\0"))

    def __str__(self) -> str:
        """Write candump's compact notation."""
        can_id = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        return f"{can_id}##{self.flags:X}{self.data.hex().upper()}"


class FdBits(NamedTuple):
    """The length of a CAN FD frame on the bus in bits, separately for its two bit rates.

    The rate is assumed to switch after the bit BRS and before the CRC delimiter. In reality the
    rate switches at the sample points of these two bits, which differ from bus to bus.

    Attributes:
        nominal: number of bits at the nominal bit rate, with the interframe space.
        fast: number of bits at the data bit rate. In a frame without BRS, this number is 0.
    """

    nominal: int
    fast: int


# Stuff count with its parity (4), CRC of 17 or 21 bits, and a fixed stuff bit before each four bits
# of these fields.
_CRC_FIELD: Final = {False: 4 + 17 + 6, True: 4 + 21 + 7}
"""Number of bits of stuff count, CRC and fixed stuff bits. The key is whether the data exceed 16
bytes."""

_TAIL: Final = 1 + 2 + 7 + INTERFRAME_BITS  # CRC delimiter, ACK, end of frame
_KEPT: Final = 1_024


def fd_bits(frame: FdFrame) -> FdBits:
    """Return the length of a CAN FD frame in bits, with all stuff bits (ISO 11898-1).

    The bits from start of frame to the end of the data are stuffed as in classic CAN. The CRC field
    has stuff bits at fixed positions. If a stuff bit would be needed right after the last data bit,
    the first fixed stuff bit takes its place.
    """
    data, length = frame.data, frame.dlc
    nominal, fast, state = _fd_head(frame.can_id, frame.extended, frame.flags, length)
    for byte in data:
        place = state << 8 | byte
        fast += STUFFED[place]
        state = NEXT[place] >> 8
    # The automaton inserts a stuff bit after the fifth equal bit of the data. At the end of the
    # data a fixed stuff bit follows anyway.
    fast -= state >> 2 != (data[-1] if data else length) & 1  # the last bit was a stuff bit
    fast += 8 * len(data) + _CRC_FIELD[len(data) > 16]
    return FdBits(nominal, fast) if frame.flags & BRS else FdBits(nominal + fast, 0)


@lru_cache(_KEPT)
def _fd_head(can_id: int, extended: bool, flags: int, dlc: int) -> tuple[int, int, int]:
    """Return the bits at each rate without data and CRC, and the state before the data."""
    brs, esi = flags & BRS, flags >> 1 & 1
    if extended:
        # SOF, 11 bits, SRR IDE, 18 bits, RRS FDF r0, BRS. For 11 bits, below: SOF, 11 bits, RRS IDE
        # FDF r0, BRS.
        stream = f"0{can_id >> 18:011b}11{can_id & 0x3_FFFF:018b}010{brs}"
    else:
        stream = f"0{can_id:011b}0010{brs}"
    last, run, slow = _stuff(1, 0, stream)
    last, run, stuffed = _stuff(last, run, f"{esi}{dlc:04b}")
    return len(stream) + slow + _TAIL, 5 + stuffed, last << 2 | run - 1


def _stuff(last: int, run: int, stream: str) -> tuple[int, int, int]:
    """Return value and run of the last bit, and the number of stuffed bits."""
    stuffed = 0
    for bit in map(int, stream):
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            last, run, stuffed = 1 - bit, 1, stuffed + 1
    return last, run, stuffed


def parse_sent(text: str) -> CanFrame | FdFrame:
    """Parse a CAN or CAN FD frame in candump's compact notation, such as `123#AABB`.

    `##` in place of `#` marks a CAN FD frame.

    Raises:
        FramingError: the text is not a frame in this notation.
        FieldError: an identifier or length is out of range.
    """
    return FdFrame.parse(text) if "##" in text else CanFrame.parse(text)


ERROR_FLAG: Final = 0x2000_0000
"""Flag that marks an identifier as that of an error frame (linux/can.h, CAN_ERR_FLAG)."""

ERROR_CLASS_MASK: Final = 0x1FFF_FFFF

_ERROR_NOTATION: Final = re.compile(r"([23][0-9A-Fa-f]{7})#([0-9A-Fa-f]{16})")


class ErrorState(IntEnum):
    """State of fault confinement (ISO 11898-1)."""

    ACTIVE = 0
    PASSIVE = 1
    BUS_OFF = 2


class ErrorFrame(NamedTuple):
    """An error frame of SocketCAN (linux/can/error.h), which reports an error on the bus.

    Attributes:
        error_class: class of the error, as a set of CAN_ERR_ bits.
        data: eight bytes with details.
    """

    error_class: int
    data: bytes = bytes(8)

    @classmethod
    def parse(cls, text: str) -> ErrorFrame:
        """Read candump's notation; raise FramingError if the text is not an error frame."""
        match = _ERROR_NOTATION.fullmatch(text)
        if match is None:
            raise FramingError(f"{text!r} is not an error frame like {NO_ACK}")
        return cls(int(match[1], 16) & ERROR_CLASS_MASK, bytes.fromhex(match[2]))

    def __str__(self) -> str:
        """Write candump's notation."""
        return f"{ERROR_FLAG | self.error_class:08X}#{self.data.hex().upper()}"


NO_ACK: Final = ErrorFrame(0x20)
"""Error frame after a frame that no node has acknowledged: CAN_ERR_ACK."""

BIT_ERROR: Final = ErrorFrame(0x88, bytes((0, 0, 1, 0, 0, 0, 0, 0)))
"""Error frame after a bit that differed from the sent bit: CAN_ERR_PROT and BUSERROR, PROT_BIT."""


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
    """Bytes 6 and 7 of the data are TEC and REC."""


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
    """Return the meaning of an error frame as text.

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


_LINE: Final = re.compile(r"\(([0-9]{1,12})\.([0-9]{6})\) (\S{1,32}) (\S+)(?: [RT])?", re.ASCII)
_ERROR: Final = re.compile(r"[23][0-9A-Fa-f]{7}#.*")  # bit 29: no identifier has it


class CandumpError(ValueError):
    """A text is not a line of a CAN log."""


class LogLine(NamedTuple):
    """A line of a candump log: a frame or error frame with its time and its bus.

    Attributes:
        at_us: time of the end of the frame, in us.
        channel: name of the bus, without blanks.
        received: frame or error frame on the bus.
    """

    at_us: int
    channel: str
    received: CanFrame | ErrorFrame | FdFrame

    def __str__(self) -> str:
        """Write the line, without LF."""
        seconds, micros = divmod(self.at_us, 1_000_000)
        return f"({seconds:010d}.{micros:06d}) {self.channel} {self.received}"


def parse_line(line: str, number: int = 1) -> LogLine:
    """Read one line; raise CandumpError if the line is invalid."""
    match = _LINE.fullmatch(line.rstrip())
    if match is None:
        raise CandumpError(
            f"line {number} is not like '(0000000000.010000) vcan0 705#7F': {line!r:.60}"
        )
    seconds, micros, channel, text = match.groups()
    # Bit 29 in eight digits: SocketCAN's mark of an error frame.
    kind: type[CanFrame | ErrorFrame] = ErrorFrame if _ERROR.fullmatch(text) else CanFrame
    try:
        return LogLine(int(seconds) * 1_000_000 + int(micros), channel, kind.parse(text))
    except WireError as error:
        raise CandumpError(f"line {number}: {error}") from error


def parse_log(text: str) -> tuple[LogLine, ...]:
    """Read a log; empty lines are skipped.

    Raises:
        CandumpError: a line is invalid.
    """
    lines = enumerate(text.splitlines(), 1)
    return tuple(parse_line(line, number) for number, line in lines if line.strip())
