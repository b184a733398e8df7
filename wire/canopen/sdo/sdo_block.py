r"""SDO block transfer: its frames as values (CiA 301, SDO block protocols).

>>> BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=30).encode().hex()
'c60720001e000000'
>>> BlockSegment.parse(bytes.fromhex("852E2E0000000000"))
BlockSegment(seqno=5, data=b'..\x00\x00\x00\x00\x00', last=True)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

import crcmod

from tickrig.wire.canopen.sdo.sdo_command import (
    BLOCK_ACKNOWLEDGE,
    BLOCK_CRC,
    BLOCK_END,
    BLOCK_ENDED,
    BLOCK_LAST,
    BLOCK_SEQNO,
    BLOCK_SIZE_INDICATED,
    BLOCK_START,
    FRAME_BYTES,
    SEGMENT_BYTES,
    ClientCommand,
    ServerCommand,
    frame_at,
    index_sub,
    number_field,
)
from tickrig.wire.errors import FieldError


@dataclass(frozen=True, slots=True)
class BlockSegment:
    """7 bytes of a block, either way; the fill of the last one is said at the end.

    Attributes:
        seqno: 1..127, its place in the block.
        last: no more segments follow.
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
    """Begin of a transfer whose sender says the size.

    Attributes:
        crc: the sender can do the CRC.
        size: number of bytes, None if it is not indicated.
    """

    index: int
    sub: int
    crc: bool
    size: int | None

    def encode(self) -> bytes:
        """Return the 8 bytes."""
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
    """Answer to `BlockUploadInitiateRequest`."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class BlockDownloadInitiateResponse:
    """Answer to `BlockDownloadInitiateRequest`.

    Attributes:
        crc: the server can do the CRC.
        block_size: segments in the first block, 1..127.
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
    """Initiate SDO block upload.

    Attributes:
        crc: the client can do the CRC.
        block_size: segments in the first block, 1..127.
        threshold: protocol switch threshold, 0 to forbid the switch to another upload.
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
    """The client of a block upload is ready for segments."""

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return bytes([BLOCK_START, *bytes(SEGMENT_BYTES)])

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls()


@dataclass(frozen=True, slots=True)
class BlockAcknowledge:
    """Receipt of a block, either way.

    Attributes:
        ackseq: the last segment that came in sequence, 0 for none.
        block_size: segments in the next block, 1..127.
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
    """All segments are received: what the sender says of them, either way.

    Attributes:
        fill: bytes of the last segment that are no data, 0..7.
        crc: 0 if one side cannot do it.
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
    """Answer to `BlockEnd`, either way."""

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return bytes([BLOCK_ENDED, *bytes(SEGMENT_BYTES)])

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls()


_crc: Final = crcmod.mkCrcFun(0x1_1021, initCrc=0, rev=False, xorOut=0)


def crc16(data: bytes) -> int:
    """Return the CRC over the data of a block transfer, without the fill of the last segment."""
    return _crc(data)
