r"""SDO command bytes, abort codes and the frames of block transfer (CiA 301, 7.2.4).

SDO abort codes (CiA 301, table of SDO abort codes).

>>> describe_abort(0x0602_0000), describe_abort(0x0601_0003)
('object does not exist (06020000h)', 'unknown (06010003h)')

SDO block transfer: its frames as values (CiA 301, SDO block protocols).

>>> BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=30).encode().hex()
'c60720001e000000'
>>> BlockSegment.parse(bytes.fromhex("852E2E0000000000"))
BlockSegment(seqno=5, data=b'..\x00\x00\x00\x00\x00', last=True)
"""

# Theory of operation of block transfer (CiA 301, SDO block protocols).
#
# A segmented transfer has an answer for each 7 bytes, a block transfer one for each block of up to
# 127 segments. The three phases, with the first byte of each frame:
#
#   download   client                       server
#   initiate   C0h | crc 4 | size 2      -> A0h | crc 4, and segments a block in byte 4
#   block      01h .. 7Fh, the last one  -> A2h ackseq blksize: the last segment that came in
#                with bit 7 (85h)             sequence, and how long the next block may be
#   end        C1h | fill << 2, crc      -> A1h
#
#   upload     client                       server
#   initiate   A0h | crc 4, blksize      -> C0h | crc 4 | size 2, size
#   start      A3h                       -> 01h .. 7Fh
#   block      A2h ackseq blksize        -> the next block, or the end
#   end        A1h                       <- C1h | fill << 2, crc
#
# Rules. A segment has no command byte: its first byte is the sequence number, so it looks like any
# other frame. Only who knows that a block is under way can read it, which is why `parse_request`
# and `parse_response` know no segments and `BlockSegment.parse` is called by name. Bit 7 says "no
# more segments", not "end of the block". The last segment is always 7 bytes; only the end frame
# tells how many of them are fill. `ackseq` is 0 if not even segment 1 came; the
# sender repeats from ackseq + 1 with new sequence numbers from 1. Either side ends the transfer by
# an abort at any time, which a receiver must look for before it takes a segment: 80h is sequence
# number 0 with bit 7, and no segment has number 0.
#
# The CRC is that of XMODEM (polynomial 1021h, initial value 0) over all data without the fill. It
# counts only if both sides set the bit; else the field is 0.
#
# Lost frames. A segment that is lost is repeated after the receipt. CiA 301 has no way on if the
# last segment of a block or its receipt is lost: both sides wait, and time out.

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct, error
from typing import Final, Self

import crcmod

from tickrig.wire.canopen.described_code import DescribedCode
from tickrig.wire.errors import FieldError, FramingError


class AbortCode(DescribedCode):
    """Reason for the abort of an SDO transfer."""

    TOGGLE_BIT = 0x0503_0000, "toggle bit not alternated"
    TIMEOUT = 0x0504_0000, "SDO protocol timed out"
    COMMAND_SPECIFIER = 0x0504_0001, "command specifier not valid"
    BLOCK_SIZE = 0x0504_0002, "invalid block size"
    SEQUENCE_NUMBER = 0x0504_0003, "invalid sequence number"
    CRC = 0x0504_0004, "CRC error"
    OUT_OF_MEMORY = 0x0504_0005, "out of memory"
    UNSUPPORTED_ACCESS = 0x0601_0000, "unsupported access"
    WRITE_ONLY = 0x0601_0001, "object is write only"
    READ_ONLY = 0x0601_0002, "object is read only"
    NO_OBJECT = 0x0602_0000, "object does not exist"
    NOT_MAPPABLE = 0x0604_0041, "object cannot be mapped"
    PDO_LENGTH = 0x0604_0042, "mapped objects exceed the PDO length"
    PARAMETER_INCOMPATIBLE = 0x0604_0043, "parameters are incompatible"
    INTERNAL_INCOMPATIBLE = 0x0604_0047, "internal incompatibility"
    HARDWARE = 0x0606_0000, "hardware error"
    LENGTH = 0x0607_0010, "length does not match"
    TOO_LONG = 0x0607_0012, "too long"
    TOO_SHORT = 0x0607_0013, "too short"
    NO_SUBINDEX = 0x0609_0011, "sub-index does not exist"
    VALUE_RANGE = 0x0609_0030, "invalid value"
    VALUE_TOO_HIGH = 0x0609_0031, "value too high"
    VALUE_TOO_LOW = 0x0609_0032, "value too low"
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036, "maximum below minimum"
    NO_RESOURCE = 0x060A_0023, "resource not available"
    GENERAL = 0x0800_0000, "general error"
    NOT_STORED = 0x0800_0020, "cannot be transferred or stored"
    LOCAL_CONTROL = 0x0800_0021, "not possible under local control"
    DEVICE_STATE = 0x0800_0022, "not possible in this device state"
    NO_DICTIONARY = 0x0800_0023, "no object dictionary"
    NO_DATA = 0x0800_0024, "no data available"


_TEXTS: Final = {int(code): code.text for code in AbortCode}


def describe_abort(code: int) -> str:
    """Return the text of an abort code with its number."""
    return f"{_TEXTS.get(code, 'unknown')} ({code:08X}h)"


# Command bytes of SDO frames, and the layout of their 8 bytes (CiA 301, SDO protocols).

REQUEST_COB_ID: Final = 0x600
RESPONSE_COB_ID: Final = 0x580
"""CAN-IDs of requests and responses of the default SDO server, to which the node-ID is added."""

FRAME_BYTES: Final = 8
EXPEDITED_BYTES: Final = 4
SEGMENT_BYTES: Final = 7
MAX_BLOCK_SIZE: Final = 127

# The command byte, bit by bit (CiA 301, 7.2.4.3):
#
#                          7 6 5   4    3 2    1    0
# initiate, both ways      cs      0    n      e    s    n: bytes of 4 that are unused
# segment, both ways      0 0 0    t    n n    n    c    n: bytes of 7 that are unused
# other segment frame      cs      t    0 0    0    0
# block segment             c      sequence number 1..127
# block initiate           cs      0    0 crc  s    subcommand   s: size indicated
# block end                cs      n    n n    0    subcommand   n: of the last segment
# ... of an upload         cs      0    0 crc  subcommand, two bits
#
# The specifiers of client and server differ (a download is 20h there and 60h here), and in
# a block the first byte has no specifier at all: who reads a frame must know which side
# sent it, and whether a block is running.
TOGGLE: Final = 0x10
LAST: Final = 0x01
"""Bit c of a segment: no more segments follow."""
SIZE_INDICATED: Final = 0x01
EXPEDITED: Final = 0x02

BLOCK_LAST: Final = 0x80
BLOCK_SEQNO: Final = 0x7F
BLOCK_CRC: Final = 0x04
BLOCK_SIZE_INDICATED: Final = 0x02


class ClientCommand(IntEnum):
    """Client command specifier: bits 7 to 5 of a request."""

    DOWNLOAD_SEGMENT = 0x00
    DOWNLOAD = 0x20
    UPLOAD = 0x40
    UPLOAD_SEGMENT = 0x60
    ABORT = 0x80
    BLOCK_UPLOAD = 0xA0
    BLOCK_DOWNLOAD = 0xC0


class ServerCommand(IntEnum):
    """Server command specifier: bits 7 to 5 of a response."""

    UPLOAD_SEGMENT = 0x00
    DOWNLOAD_SEGMENT = 0x20
    UPLOAD = 0x40
    DOWNLOAD = 0x60
    ABORT = 0x80
    BLOCK_DOWNLOAD = 0xA0
    BLOCK_UPLOAD = 0xC0


SPECIFIER: Final = 0xE0

BLOCK_ENDED: Final = 0xA1
BLOCK_ACKNOWLEDGE: Final = 0xA2
BLOCK_START: Final = 0xA3
BLOCK_END: Final = 0xC1
"""Commands of a block transfer. These four are equal for client and server. An end has n in bits 4
to 2."""
BLOCK_SUBCOMMAND: Final = 0x03
"""Bits of the subcommand in a block upload and in an acknowledgement."""


_FRAME: Final = Struct("<BHB4s")


def frame_at(command: int, index: int, sub: int, rest: bytes = b"") -> bytes:
    """Return a frame of command byte, multiplexer and up to 4 bytes."""
    try:
        return _FRAME.pack(command, index, sub, rest)
    except error:
        raise FieldError(f"{index:X}h:{sub:X} is not in 0000h:00 to FFFFh:FF") from None


def index_sub(frame: bytes) -> tuple[int, int]:
    """Return index and sub-index of a frame that has a multiplexer."""
    return frame[1] | frame[2] << 8, frame[3]


def number_field(number: int) -> bytes:
    """Return the 4 bytes of a size or an abort code."""
    if not 0 <= number < 1 << 32:
        raise FieldError(f"{number} does not fit into 32 bits")
    return number.to_bytes(4, "little")


def check_frame(frame: bytes) -> None:
    """Raise FramingError unless a frame has the length of all SDO frames."""
    if len(frame) != FRAME_BYTES:
        raise FramingError(f"an SDO frame of {len(frame)} bytes, it has {FRAME_BYTES}")


@dataclass(frozen=True, slots=True)
class BlockSegment:
    """An SDO frame with one segment of 7 bytes in a block transfer.

    In the last segment some bytes may be unused. `BlockEnd` contains their number.

    Attributes:
        seqno: position in the block, 1..127.
        last: whether no more segments follow.
    """

    seqno: int
    data: bytes
    last: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.seqno <= BLOCK_SEQNO or len(self.data) > SEGMENT_BYTES:
            raise FieldError(f"block segment {self.seqno} of {len(self.data)} bytes")

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        head = self.seqno | (BLOCK_LAST if self.last else 0)
        return bytes([head]) + self.data.ljust(SEGMENT_BYTES, b"\0")

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(frame[0] & BLOCK_SEQNO, frame[1:], bool(frame[0] & BLOCK_LAST))


@dataclass(frozen=True, slots=True)
class _BlockInitiate:
    """Initiate frame of a block transfer from the sender of the data.

    Attributes:
        crc: whether the sender supports the CRC.
        size: number of bytes, or None if it is not indicated.
    """

    index: int
    sub: int
    crc: bool
    size: int | None

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        # C0h both ways: a client's block download and a server's answer to block upload.
        command = 0xC0 | self.crc * BLOCK_CRC
        if self.size is not None:
            command |= BLOCK_SIZE_INDICATED
        return frame_at(command, self.index, self.sub, number_field(self.size or 0))

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        indicated = bool(frame[0] & BLOCK_SIZE_INDICATED)
        size = int.from_bytes(frame[4:], "little") if indicated else None
        return cls(*index_sub(frame), bool(frame[0] & BLOCK_CRC), size)


class BlockDownloadInitiateRequest(_BlockInitiate):
    """Initiate SDO block download."""

    __slots__ = ()


class BlockUploadInitiateResponse(_BlockInitiate):
    """Response to `BlockUploadInitiateRequest`."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class BlockDownloadInitiateResponse:
    """The server's SDO frame that accepts a block download (`BlockDownloadInitiateRequest`).

    Attributes:
        crc: whether the server supports the CRC.
        block_size: number of segments in the first block, 1..127.
    """

    index: int
    sub: int
    crc: bool
    block_size: int

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        command = ServerCommand.BLOCK_DOWNLOAD | self.crc * BLOCK_CRC
        return frame_at(command, self.index, self.sub, bytes([self.block_size]))

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(*index_sub(frame), bool(frame[0] & BLOCK_CRC), frame[4])


@dataclass(frozen=True, slots=True)
class BlockUploadInitiateRequest:
    """The client's SDO frame that starts a block upload ("initiate SDO block upload").

    Attributes:
        crc: whether the client supports the CRC.
        block_size: number of segments in the first block, 1..127.
        threshold: protocol switch threshold: a number of bytes up to which the server may switch to
            another kind of upload, or 0 to forbid the switch.
    """

    index: int
    sub: int
    crc: bool
    block_size: int
    threshold: int = 0

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        command = ClientCommand.BLOCK_UPLOAD | self.crc * BLOCK_CRC
        return frame_at(command, self.index, self.sub, bytes([self.block_size, self.threshold]))

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(*index_sub(frame), bool(frame[0] & BLOCK_CRC), frame[4], frame[5])


@dataclass(frozen=True, slots=True)
class BlockStart:
    """The client of a block upload requests the segments."""

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return bytes([BLOCK_START, *bytes(SEGMENT_BYTES)])

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls()


@dataclass(frozen=True, slots=True)
class BlockAcknowledge:
    """An SDO frame with which the receiver of a block acknowledges its segments.

    Attributes:
        ackseq: number of the last segment received in sequence, or 0 for none.
        block_size: number of segments in the next block, 1..127.
    """

    ackseq: int
    block_size: int

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return bytes([BLOCK_ACKNOWLEDGE, self.ackseq, self.block_size, *bytes(5)])

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(frame[1], frame[2])


@dataclass(frozen=True, slots=True)
class BlockEnd:
    """An SDO frame with which the sender of the data ends a block transfer.

    Attributes:
        fill: number of unused bytes of the last segment, 0..7.
        crc: CRC of the data, or 0 if one side does not support it.
    """

    fill: int
    crc: int

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        head = bytes([BLOCK_END | self.fill << 2])
        return (head + self.crc.to_bytes(2, "little")).ljust(FRAME_BYTES, b"\0")

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(frame[0] >> 2 & 7, int.from_bytes(frame[1:3], "little"))


@dataclass(frozen=True, slots=True)
class BlockEnded:
    """Response to `BlockEnd`, in either direction."""

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return bytes([BLOCK_ENDED, *bytes(SEGMENT_BYTES)])

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls()


# x^16 + x^12 + x^5 + 1 from 0, not reflected: "123456789" gives 31C3h (CiA 301, CRC of SDO
# block).
_crc: Final = crcmod.mkCrcFun(0x1_1021, initCrc=0, rev=False, xorOut=0)


def crc16(data: bytes) -> int:
    """Return the CRC of the data of an SDO block transfer, without the unused bytes at the end."""
    return _crc(data)
